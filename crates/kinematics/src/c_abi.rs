//! [`CalibratedArm`] and [`Motion`] for C: `include/armcal_kinematics.h` says what each function does.
//!
//! The one file of the crate with `unsafe` in it. What every function asks of its caller, and relies on:
//!
//! * a handle comes from the function that makes it, and is freed once, by the function for it; NULL is refused, and freed
//!   without effect;
//! * a vector of joints has as many numbers as the arm has joints, an output has room for what the header says; NULL stands
//!   for "not known" or "not wanted" where the header says so, and is refused elsewhere;
//! * one motion is used by one thread at a time; an arm by any number of them. A motion keeps its arm alive.
//!
//! A panic stops here: it becomes [`Code::Internal`].

#![expect(unsafe_code, reason = "C knows no references: the contract above takes their place")]
#![allow(clippy::missing_safety_doc, reason = "the contract is the same for all of them and stands above")]

use crate::{CalibratedArm, Conditions, Driven, KinematicsError, Motion, Point};
use armcal_compensate::SetPoint;
use armcal_core::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::Arc;

/// What a function returns.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// Done.
    Ok = 0,
    /// An argument makes no sense.
    Argument = 1,
    /// The text is no model of this version.
    Model = 2,
    /// No set-point brings the tip there.
    Unreachable = 3,
    /// A mistake in armcal.
    Internal = 4,
}

/// `armcal_arm`.
pub struct ArmHandle {
    arm: CalibratedArm,
    /// By kind: joints, tips, recordings, effects, what is missing.
    names: [Vec<CString>; 5],
}

/// `armcal_motion`.
pub struct MotionHandle {
    /// Borrows from `arm`, which is dropped after it and does not move: it is behind an `Arc`.
    motion: Motion<'static>,
    joints: usize,
    warnings: CString,
    _arm: Arc<ArmHandle>,
}

/// `armcal_conditions`.
#[repr(C)]
pub struct CConditions {
    tip: usize,
    in_base: i32,
    recording: i32,
    load_kg: f64,
    temperature_c: f64,
}

/// `armcal_pose`.
#[repr(C)]
pub struct CPose {
    position_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
}

/// `armcal_reached`.
#[repr(C)]
pub struct CReached {
    before_m: f64,
    after_m: f64,
    before_rad: f64,
    after_rad: f64,
}

thread_local! {
    static ERROR: RefCell<CString> = RefCell::default();
}

/// Text for C, without what would end it early.
fn c_string(words: &str) -> CString {
    CString::new(words.replace('\0', "\\0")).unwrap_or_default()
}

/// Runs what a function does; what goes wrong becomes a code and a message.
pub(crate) fn run_guarded(work: impl FnOnce() -> Result<(), KinematicsError>) -> Code {
    let (code, message) = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => return Code::Ok,
        Ok(Err(error)) => {
            let code = match &error {
                KinematicsError::Argument { .. } => Code::Argument,
                KinematicsError::File(_) | KinematicsError::Model(_) => Code::Model,
                KinematicsError::SetPoint(armcal_compensate::CompensateError::Unreachable { .. }) => {
                    Code::Unreachable
                }
                KinematicsError::SetPoint(_) => Code::Argument,
            };
            (code, error.to_string())
        }
        Err(_) => {
            (Code::Internal, "a mistake in armcal: please report the model.json and the call".to_owned())
        }
    };
    ERROR.with_borrow_mut(|last| *last = c_string(&message));
    code
}

/// The same with the motion that it is about.
fn with_motion<H>(motion: Option<H>, work: impl FnOnce(H) -> Result<(), KinematicsError>) -> Code {
    run_guarded(|| work(motion.ok_or_else(|| null_argument("motion"))?))
}

fn null_argument(what: &'static str) -> KinematicsError {
    KinematicsError::Argument { what, problem: "must not be NULL".into() }
}

/// SAFETY: `at` is NULL or points to `length` numbers.
unsafe fn numbers<'a>(at: *const f64, length: usize) -> Option<&'a [f64]> {
    // SAFETY: as above.
    (!at.is_null()).then(|| unsafe { std::slice::from_raw_parts(at, length) })
}

/// SAFETY: `at` is NULL or points to `length` numbers.
unsafe fn needed<'a>(
    at: *const f64,
    length: usize,
    what: &'static str,
) -> Result<&'a [f64], KinematicsError> {
    // SAFETY: as above.
    unsafe { numbers(at, length) }.ok_or_else(|| null_argument(what))
}

/// SAFETY: `at` is NULL or has room for as many numbers as there are.
unsafe fn put(at: *mut f64, numbers: impl ExactSizeIterator<Item = f64>) {
    if !at.is_null() {
        // SAFETY: as above; what is written over are plain numbers.
        numbers.enumerate().for_each(|(k, number)| unsafe { at.add(k).write(number) });
    }
}

/// SAFETY: `at` is NULL or has room for it.
unsafe fn set<T>(at: *mut T, what: &'static str, value: T) -> Result<(), KinematicsError> {
    if at.is_null() {
        return Err(null_argument(what));
    }
    // SAFETY: as above; the caller's memory may not have been set to anything, so nothing in it is dropped.
    unsafe { at.write(value) };
    Ok(())
}

/// A number that may be missing.
fn unless_nan(number: f64) -> Option<f64> {
    (!number.is_nan()).then_some(number)
}

impl From<&CConditions> for Conditions {
    fn from(c: &CConditions) -> Conditions {
        Conditions {
            tip: c.tip,
            in_base: c.in_base != 0,
            recording: usize::try_from(c.recording).ok(),
            load_kg: unless_nan(c.load_kg),
            temperature_c: unless_nan(c.temperature_c),
        }
    }
}

impl From<&Pose> for CPose {
    fn from(pose: &Pose) -> CPose {
        let q = pose.rotation.coords;
        CPose { position_m: pose.translation.vector.into(), quaternion_xyzw: [q.x, q.y, q.z, q.w] }
    }
}

impl MotionHandle {
    /// Lays a set-point out, and keeps what is to be known of it.
    ///
    /// SAFETY: outputs are NULL or have room for a number a joint, `reached` for one.
    unsafe fn answer(
        &mut self,
        point: &SetPoint,
        [nominal, corrected, direction]: [*mut f64; 3],
        reached: *mut CReached,
    ) {
        self.warnings = c_string(&point.warnings.join("\n"));
        let turn =
            |k: usize| point.reached.as_ref().and_then(|r| r.turn_rad).map_or(f64::NAN, |turn| turn[k]);
        let metres = |of: fn(&armcal_compensate::Reached) -> f64| point.reached.as_ref().map_or(f64::NAN, of);
        // SAFETY: as above.
        unsafe {
            put(nominal, point.nominal_rad.iter().copied());
            put(corrected, point.joint_rad.iter().copied());
            put(direction, point.arrival.iter().map(|arrival| arrival.sign()));
            if !reached.is_null() {
                reached.write(CReached {
                    before_m: metres(|r| r.before_m),
                    after_m: metres(|r| r.after_m),
                    before_rad: turn(0),
                    after_rad: turn(1),
                });
            }
        }
    }
}

/// Version of the library.
#[unsafe(no_mangle)]
pub extern "C" fn armcal_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => panic!("a version without zeros"),
        };
    VERSION.as_ptr()
}

/// What went wrong in the last call of this thread that failed.
#[unsafe(no_mangle)]
pub extern "C" fn armcal_error() -> *const c_char {
    ERROR.with_borrow(|last| last.as_ptr())
}

/// Reads a model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_arm_load(
    json: *const c_char,
    length: usize,
    arm: *mut *const ArmHandle,
) -> Code {
    run_guarded(|| {
        if json.is_null() {
            return Err(null_argument("json"));
        }
        // SAFETY: the contract: as many bytes as said.
        let bytes = unsafe { std::slice::from_raw_parts(json.cast::<u8>(), length) };
        let loaded = CalibratedArm::from_json(&String::from_utf8_lossy(bytes))?;
        let all = |names: &mut dyn Iterator<Item = &str>| names.map(c_string).collect::<Vec<CString>>();
        let names = [
            all(&mut loaded.joints().iter().map(String::as_str)),
            all(&mut loaded.tips()),
            all(&mut loaded.file.recordings.iter().map(|r| r.name.as_str())),
            loaded.effects().map(|effect| c_string(&effect)).collect(),
            all(&mut loaded.file.missing.iter().map(String::as_str)),
        ];
        let handle = Arc::into_raw(Arc::new(ArmHandle { arm: loaded, names }));
        // SAFETY: the contract: room for a handle.
        unsafe { set(arm, "arm", handle) }.inspect_err(|_| {
            // SAFETY: made above, handed to nobody.
            drop(unsafe { Arc::from_raw(handle) });
        })
    })
}

/// Frees a model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_arm_free(arm: *const ArmHandle) {
    if !arm.is_null() {
        // SAFETY: the contract: from `armcal_arm_load`, freed once.
        drop(unsafe { Arc::from_raw(arm) });
    }
}

/// Number of joints.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_arm_joints(arm: *const ArmHandle) -> usize {
    // SAFETY: the contract: NULL or a handle.
    unsafe { arm.as_ref() }.map_or(0, |handle| handle.arm.joint_count())
}

/// Whether a joint slides.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_arm_slides(arm: *const ArmHandle, joint: usize) -> i32 {
    // SAFETY: the contract: NULL or a handle.
    let arm = unsafe { arm.as_ref() }.map(|handle| &handle.arm);
    i32::from(arm.is_some_and(|arm| joint < arm.joint_count() && arm.slides(joint)))
}

/// A name by its kind and number; NULL behind the last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_arm_name(arm: *const ArmHandle, kind: u32, index: usize) -> *const c_char {
    // SAFETY: the contract: NULL or a handle.
    let arm = unsafe { arm.as_ref() };
    let name = arm.and_then(|handle| handle.names.get(kind as usize)?.get(index));
    name.map_or(ptr::null(), |name| name.as_ptr())
}

/// An arm under conditions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_new(
    arm: *const ArmHandle,
    conditions: *const CConditions,
    motion: *mut *mut MotionHandle,
) -> Code {
    run_guarded(|| {
        if arm.is_null() {
            return Err(null_argument("arm"));
        }
        // SAFETY: the contract: a handle, which this one keeps alive.
        let arm = unsafe {
            Arc::increment_strong_count(arm);
            Arc::from_raw(arm)
        };
        // SAFETY: the contract: NULL or conditions.
        let asked = unsafe { conditions.as_ref() }.map(Conditions::from).unwrap_or_default();
        // SAFETY: what is behind the `Arc` stays where it is and unchanged until the handle drops it, after the motion.
        let kept: &'static CalibratedArm = unsafe { &*ptr::from_ref(&arm.arm) };
        let (made, joints) = (kept.motion(&asked)?, kept.joint_count());
        let handle = MotionHandle { motion: made, joints, warnings: CString::default(), _arm: arm };
        let handle = Box::into_raw(Box::new(handle));
        // SAFETY: the contract: room for a handle.
        unsafe { set(motion, "motion", handle) }.inspect_err(|_| {
            // SAFETY: made above, handed to nobody.
            drop(unsafe { Box::from_raw(handle) });
        })
    })
}

/// Frees a motion.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_free(motion: *mut MotionHandle) {
    if !motion.is_null() {
        // SAFETY: the contract: from `armcal_motion_new`, freed once.
        drop(unsafe { Box::from_raw(motion) });
    }
}

/// Where the arm waits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_start(motion: *mut MotionHandle, joint: *const f64) -> Code {
    // SAFETY: the contract: NULL or a handle, and NULL or a number a joint.
    with_motion(unsafe { motion.as_mut() }, |handle| {
        handle.motion.start(unsafe { numbers(joint, handle.joints) })
    })
}

/// The arm goes there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_go(motion: *mut MotionHandle, joint: *const f64) -> Code {
    // SAFETY: the contract: NULL or a handle, and a number a joint.
    with_motion(unsafe { motion.as_mut() }, |handle| {
        handle.motion.go(unsafe { needed(joint, handle.joints, "joint") }?)
    })
}

/// The tip of the calibrated arm.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_tip(
    motion: *const MotionHandle,
    joint: *const f64,
    direction: *const f64,
    velocity: *const f64,
    effort: *const f64,
    tip: *mut CPose,
) -> Code {
    // SAFETY: the contract: NULL or a handle.
    with_motion(unsafe { motion.as_ref() }, |handle| {
        // SAFETY: the contract: NULL or a number a joint, room for a pose.
        unsafe {
            let of_joints = |at: *const f64| numbers(at, handle.joints);
            let driven = Driven {
                direction: of_joints(direction),
                velocity_radps: of_joints(velocity),
                effort_nm: of_joints(effort),
            };
            let at = handle.motion.tip(needed(joint, handle.joints, "joint")?, &driven)?;
            set(tip, "tip", CPose::from(&at))
        }
    })
}

/// The tip of the nominal arm.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_nominal_tip(
    motion: *const MotionHandle,
    joint: *const f64,
    tip: *mut CPose,
) -> Code {
    // SAFETY: the contract: NULL or a handle.
    with_motion(unsafe { motion.as_ref() }, |handle| {
        // SAFETY: the contract: a number a joint, room for a pose.
        unsafe {
            let joint = needed(joint, handle.joints, "joint")?;
            set(tip, "tip", CPose::from(&handle.motion.nominal_tip(joint)?))
        }
    })
}

/// The set-point for nominal joints.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_correct(
    motion: *mut MotionHandle,
    nominal: *const f64,
    time_s: f64,
    corrected: *mut f64,
    direction: *mut f64,
    reached: *mut CReached,
) -> Code {
    // SAFETY: the contract: NULL or a handle.
    with_motion(unsafe { motion.as_mut() }, |handle| {
        // SAFETY: the contract: a number a joint, NULL or room for what is asked.
        unsafe {
            let nominal = needed(nominal, handle.joints, "nominal")?;
            let point = handle.motion.correct(nominal, unless_nan(time_s))?;
            handle.answer(&point, [ptr::null_mut(), corrected, direction], reached);
            Ok(())
        }
    })
}

/// The set-point for a place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_set_point(
    motion: *mut MotionHandle,
    position_m: *const f64,
    quaternion_xyzw: *const f64,
    time_s: f64,
    nominal: *mut f64,
    corrected: *mut f64,
    direction: *mut f64,
    reached: *mut CReached,
) -> Code {
    // SAFETY: the contract: NULL or a handle.
    with_motion(unsafe { motion.as_mut() }, |handle| {
        // SAFETY: the contract: three numbers, NULL or four, NULL or room for what is asked.
        unsafe {
            let position = needed(position_m, 3, "position_m")?;
            let turned = numbers(quaternion_xyzw, 4).map(|q| Quaternion::new(q[3], q[0], q[1], q[2]));
            let place = Point {
                position_m: Vector3::from_column_slice(position),
                orientation: turned.map(UnitQuaternion::new_normalize),
                time_s: unless_nan(time_s),
            };
            let point = handle.motion.set_point(&place)?;
            handle.answer(&point, [nominal, corrected, direction], reached);
            Ok(())
        }
    })
}

/// The set-points of a path.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_path(
    motion: *mut MotionHandle,
    nominal: *const f64,
    time_s: *const f64,
    points: usize,
    crossing_s: f64,
    corrected: *mut f64,
    direction: *mut f64,
    in_gap: *mut u8,
    reached: *mut CReached,
) -> Code {
    // SAFETY: the contract: NULL or a handle.
    with_motion(unsafe { motion.as_mut() }, |handle| {
        let joints = handle.joints;
        let count = points.checked_mul(joints).filter(|n| *n <= isize::MAX as usize / size_of::<f64>());
        let count =
            count.ok_or_else(|| KinematicsError::argument("points", format!("{points} are too many")))?;
        // SAFETY: the contract: a number a joint and a time for each point; NULL or room for what is asked.
        unsafe {
            let nominal: Vec<&[f64]> = needed(nominal, count, "nominal")?.chunks_exact(joints).collect();
            let path = handle.motion.path(&nominal, needed(time_s, points, "time_s")?, crossing_s)?;
            let mut warnings = Vec::new();
            for (k, point) in path.iter().enumerate() {
                let of_point = |at: *mut f64| if at.is_null() { at } else { at.add(k * joints) };
                let reached = if reached.is_null() { reached } else { reached.add(k) };
                handle.answer(point, [ptr::null_mut(), of_point(corrected), of_point(direction)], reached);
                if !in_gap.is_null() {
                    (0..joints)
                        .for_each(|j| in_gap.add(k * joints + j).write(u8::from(point.in_gap.contains(&j))));
                }
                warnings.extend(point.warnings.iter().map(|words| format!("{k}: {words}")));
            }
            handle.warnings = c_string(&warnings.join("\n"));
            Ok(())
        }
    })
}

/// What is to be known of the last set-point.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn armcal_motion_warnings(motion: *const MotionHandle) -> *const c_char {
    // SAFETY: the contract: NULL or a handle.
    unsafe { motion.as_ref() }.map_or(ptr::null(), |handle| handle.warnings.as_ptr())
}
