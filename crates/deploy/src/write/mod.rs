//! The calibrated arm of a finished run in a format that others read: the text, what is in it, what is not.
//!
//! [`Source`] is the result, [`make_file`] puts the text together, [`left::remaining_errors`] says how far off it leaves the arm.

pub mod left;

use crate::error::DeployError;
use armcal_core::printable_name;
use armcal_core::{FeatureId, Pose, RollPitchYaw};
use armcal_formats::dh::DhRows;
use armcal_formats::ur::{UrKinematics, hash_in};
use armcal_formats::zeros::JointZeros;
use armcal_formats::{Format, FormatError, mjcf, sdf, urdf, xacro};
use armcal_model::{Moving, Place, Skeleton};
use armcal_result::{StoredArms, StoredModel, marked_xml};
use left::Recorded;
use std::path::Path;

/// Rows of a DH table longer than this are those of axes that are nearly parallel [m].
const LONG_M: f64 = 10.0;
/// What the digits that are shown show [mm], [deg].
const SHOWN_MM: f64 = 5e-4;
const SHOWN_DEG: f64 = 5e-5;

/// The arm that is written.
pub struct Source<'a> {
    /// The result.
    pub past: &'a StoredModel,
    /// Its models.
    pub arms: &'a StoredArms,
    /// Which arm, of several.
    pub arm: usize,
    /// Its links and joints as calibrated, effects left out.
    pub skeleton: Skeleton,
}

/// A file, and what should be known of it.
pub struct Made {
    /// The file.
    pub text: Vec<u8>,
    /// What it says of the arm.
    pub holds: Vec<String>,
    /// What the result knows beyond that.
    pub lacks: Vec<String>,
    /// The tip, where it is to be entered by hand.
    pub by_hand: Option<String>,
    /// What to know when it is used.
    pub notes: Vec<String>,
    /// The nominal arm with offsets, where that is what is written.
    pub zeros: Option<JointZeros>,
}

impl<'a> Source<'a> {
    /// An arm of the result.
    pub fn of(past: &'a StoredModel, arms: &'a StoredArms, arm: usize) -> Source<'a> {
        let root = past.urdf(arm).map_or("base", |(_, base_link)| base_link);
        Source { past, arms, arm, skeleton: arms.model.skeleton(arm, &arms.values, root) }
    }

    /// Its tip.
    fn tip(&self, format: Format) -> Result<&Place, FormatError> {
        let tip = self.skeleton.places.iter().find(|place| place.feature == FeatureId(self.arm));
        tip.ok_or_else(|| FormatError::CannotHold { format, problem: "it has no tip".into() })
    }

    fn is_urdf(&self) -> bool {
        self.past.urdf(self.arm).is_some()
    }

    /// Whether the fit changed its tip.
    fn tip_is_calibrated(&self) -> bool {
        self.arms.model.feature_parameters(FeatureId(self.arm)).any(|index| self.past.was_free(index))
    }

    /// Its moving joints.
    fn joints(&self) -> impl Iterator<Item = (&str, &Moving)> {
        self.skeleton.joints.iter().filter_map(|bone| Some((bone.name.as_str(), bone.moves.as_ref()?)))
    }

    /// How many joints have limits.
    fn limits(&self) -> usize {
        self.joints().filter(|(_, moving)| moving.limits.is_some()).count()
    }

    /// Where the tip is on its last link, for whoever enters it by hand; none where it is that link.
    fn tip_by_hand(&self, on: &str) -> Option<String> {
        let at = self.arms.model.feature_in_link(&self.arms.values, FeatureId(self.arm));
        (at != Pose::identity()).then(|| format!("the tip: in {on} it lies at {}", pose_text(&at)))
    }

    /// The markers, by name; none where there are none.
    fn markers(&self) -> Option<String> {
        let names = self.skeleton.places.iter().filter(|place| place.feature != FeatureId(self.arm));
        let names: Vec<String> = names.map(|place| printable_name(&place.name)).collect();
        (!names.is_empty()).then(|| format!("markers: {}", names.join(", ")))
    }
}

/// The file in a format. `hash_from` is the text of the arm's own kinematics file, `recorded` the session.
pub fn make_file(
    source: &Source<'_>,
    format: Format,
    hash_from: Option<&str>,
    recorded: &Recorded,
) -> Result<Made, DeployError> {
    let mut made = match format {
        Format::Urdf if source.is_urdf() => own_urdf(source)?,
        Format::Urdf => of_skeleton(source, urdf::urdf(&source.skeleton), "a link on a fixed joint"),
        Format::Mjcf => of_skeleton(source, mjcf::mjcf(&source.skeleton), "a site"),
        Format::Sdf => of_skeleton(source, sdf::sdf(&source.skeleton)?, "a frame"),
        Format::Xacro => xacro_origins(source)?,
        Format::UrYaml => ur_kinematics(source, hash_from)?,
        Format::JointZeros => joint_zeros(source, recorded),
        Format::DhCsv => dh_rows(source)?,
    };
    let effects = source.arms.model.effects().iter().map(|effect| effect.spec.to_string());
    let effects: Vec<String> = effects.collect();
    if !effects.is_empty() {
        made.lacks.insert(0, format!("effects: {}", effects.join(", ")));
    }
    if source.arms.model.arm_base_in_world(&source.arms.values, source.arm) != Pose::identity() {
        made.lacks.push("where the base stands in the world of the measurement".into());
    }
    Ok(made)
}

/// A pose for people: millimetres, and roll, pitch, yaw in degrees.
fn pose_text(pose: &Pose) -> String {
    let RollPitchYaw { xyz_m: [x, y, z], rpy_deg: [roll, pitch, yaw] } = pose.into();
    let [x, y, z] = [x, y, z].map(|v| v * 1e3 + 0.0);
    format!(
        "x {x:.3}, y {y:.3}, z {z:.3} mm, roll {:.4}, pitch {:.4}, yaw {:.4} deg",
        roll + 0.0,
        pitch + 0.0,
        yaw + 0.0
    )
}

/// The joints, by number and first and last name.
fn joints_text<'s>(what: &str, joints: impl Iterator<Item = (&'s str, &'s Moving)>) -> String {
    let joints: Vec<String> = joints.map(|(name, _)| printable_name(name)).collect();
    match &joints[..] {
        [first, .., last] => format!("{what} of {} joints, {first} to {last}", joints.len()),
        _ => format!("{what} of {}", joints.join(", ")),
    }
}

/// The URDF that the arm came from, with calibrated origins.
fn own_urdf(source: &Source<'_>) -> Result<Made, DeployError> {
    let (arms, tip) = (source.arms, source.tip_is_calibrated());
    let (text, _) = source.past.urdf(source.arm).unwrap_or_default();
    let (text, warnings) =
        arms.model.to_urdf_with(source.arm, tip, text, Path::new("URDF of the result"), &arms.values)?;
    let holds = vec![
        joints_text("origins", source.joints()),
        "everything else of the URDF that the arm came from, as it was".to_owned(),
    ];
    Ok(with_tip(
        source,
        Made { text: marked_xml(text).into(), holds, ..Made::empty() },
        tip && warnings.is_empty(),
    ))
}

/// The same origins to be included.
fn xacro_origins(source: &Source<'_>) -> Result<Made, DeployError> {
    if !source.is_urdf() {
        let problem = "it came from a DH table, and there is no description whose origins it could replace; urdf makes one";
        let problem = problem.to_owned();
        return Err(FormatError::CannotHold { format: Format::Xacro, problem }.into());
    }
    let tip = source.tip_is_calibrated();
    let (origins, warnings) = source.arms.model.calibrated_origins(source.arm, tip, &source.arms.values)?;
    let text = xacro::xacro(&origins).into_bytes();
    let made = Made { text, holds: vec![joints_text("origins", source.joints())], ..Made::empty() };
    let mut made = with_tip(source, made, tip && warnings.is_empty());
    made.notes.extend(xacro::HOW.map(str::to_owned));
    Ok(made)
}

/// What is said of tip and markers where the joints of a URDF are written: the tip is in the last, fixed one, or nowhere.
fn with_tip(source: &Source<'_>, mut made: Made, written: bool) -> Made {
    match written {
        true => made.holds.push("the tip, in the fixed joint of the tip link".into()),
        false => made.by_hand = source.tip_by_hand("the tip link"),
    }
    made.lacks.extend(source.markers());
    made
}

/// Every link and joint anew.
fn of_skeleton(source: &Source<'_>, text: String, place: &str) -> Made {
    let names: Vec<String> = source.skeleton.places.iter().map(|place| printable_name(&place.name)).collect();
    let limits = source.limits();
    let mut made = Made {
        text: text.into_bytes(),
        holds: vec![
            joints_text("origins and axes", source.joints()),
            format!("{}, {}{place}", names.join(", "), if names.len() > 1 { "each " } else { "" }),
        ],
        lacks: vec!["masses, inertias, meshes".into()],
        ..Made::empty()
    };
    if limits > 0 {
        made.holds.push(format!("limits of {limits} joints"));
    }
    if source.is_urdf() {
        made.lacks.push("links of the URDF that are not on the way to what was measured".into());
    }
    made
}

fn ur_kinematics(source: &Source<'_>, hash_from: Option<&str>) -> Result<Made, DeployError> {
    let tip = source.tip(Format::UrYaml)?;
    let kinematics = UrKinematics::of(&source.skeleton, tip, !source.is_urdf())?;
    let hash = hash_in(hash_from.unwrap_or_default())?;
    let mut made = Made {
        text: kinematics.yaml(&source.skeleton.name, &hash).into_bytes(),
        holds: vec![
            joints_text("origins", source.joints()),
            format!("the hash {hash} of the arm's own file"),
        ],
        by_hand: Some(format!("the tip: in tool0 it lies at {}", pose_text(&kinematics.tip_in_tool0))),
        ..Made::empty()
    };
    let end = kinematics.end_in_tool0;
    let (mm, deg) = (end.translation.vector.norm() * 1e3, end.rotation.angle().to_degrees());
    if mm > SHOWN_MM || deg > SHOWN_DEG {
        made.notes.push(format!(
            "the form ends with the last joint: the end of the table's last row lies {mm:.3} mm and {deg:.4} deg from tool0, \
             which is in the tip above"
        ));
    }
    made.notes.push("its base is the controller's `base`, in ur_description base_link_inertia".into());
    made.lacks.extend(source.markers());
    Ok(made)
}

fn joint_zeros(source: &Source<'_>, recorded: &Recorded) -> Made {
    let arms = source.arms;
    let nominal = &arms.geometry;
    let places = source.skeleton.places.iter().map(|place| place.feature);
    let frames: Vec<usize> = nominal
        .base_parameters(source.arm)
        .chain(places.flat_map(|feature| nominal.feature_parameters(feature)))
        .filter(|index| source.past.was_free(*index))
        .collect();
    let own =
        nominal.chain().arms().get(source.arm).map_or(0..nominal.joint_count(), |arm| arm.joints.clone());
    let joints: Vec<usize> = own.clone().collect();
    let zeros = JointZeros::fit(nominal, &arms.nominal_values, (&joints, &frames), &recorded.tips(source));
    // The skeleton of an arm counts its own joints alone.
    let of_arm = JointZeros { offset: zeros.offset[own].to_vec(), values: Vec::new() };
    let mut made = Made {
        text: of_arm.yaml(&source.skeleton).into_bytes(),
        holds: vec![joints_text("offsets", source.joints().filter(|(_, moving)| moving.follows.is_none()))],
        lacks: vec!["calibrated lengths and angles: those of the controller stay nominal".into()],
        notes: vec![
            "true reading = reading + offset; the file says what that is in ros2_control and in a URDF"
                .into(),
        ],
        zeros: Some(zeros.clone()),
        ..Made::empty()
    };
    let (tip, base) = (FeatureId(source.arm), source.arm);
    if nominal.feature_parameters(tip).any(|index| frames.contains(&index)) {
        let at = pose_text(&nominal.feature_in_link(&zeros.values, tip));
        made.by_hand = Some(format!("the tip: with these offsets it lies in the last link at {at}"));
    }
    if nominal.base_parameters(base).any(|index| frames.contains(&index)) {
        let was = arms.model.arm_base_in_world(&arms.values, base);
        let moved = was.inverse() * nominal.arm_base_in_world(&zeros.values, base);
        made.notes.push(format!(
            "the base that goes with them lies {:.3} mm and {:.4} deg from the calibrated one: measure it anew with them in",
            moved.translation.vector.norm() * 1e3,
            moved.rotation.angle().to_degrees()
        ));
    }
    made.lacks.extend(source.markers());
    made
}

fn dh_rows(source: &Source<'_>) -> Result<Made, DeployError> {
    let tip = source.tip(Format::DhCsv)?;
    let (chain, own) = source.arms.model.chain().arm(source.arm);
    let own = chain.dh_rows(&source.arms.values[own]);
    let beta = own.as_ref().is_some_and(|(_, rows)| rows.iter().any(|row| row.beta_rad != 0.0));
    let rows = DhRows::of(&source.skeleton, tip, own)?;
    let formula = match rows.convention {
        "modified" => "Rx(alpha) Tx(a) Rz(theta) Tz(d)",
        _ => "Rz(theta) Tz(d) Tx(a) Rx(alpha)",
    };
    let mut made = Made {
        text: rows.csv()?,
        holds: vec![joints_text("rows", source.joints())],
        notes: vec![format!(
            "{} DH: {formula}, the reading is added to theta (sliding: to d)",
            rows.convention
        )],
        ..Made::empty()
    };
    made.by_hand =
        source.tip_by_hand(if source.is_urdf() { "the tip link" } else { "the end of the last row" });
    made.lacks.extend(source.markers());
    if source.limits() > 0 {
        made.lacks.push("limits of the joints".into());
    }
    if rows.rows.iter().any(|row| row.motion.is_none()) {
        made.notes.push("fixed rows are where no joint moves: enter one before the first joint as the base, the others as the tool".into());
    }
    if beta {
        made.notes.push(
            "Hayati's beta, which has no column, is in the other numbers of standard rows made anew".into(),
        );
    }
    if rows.longest_m() > LONG_M {
        made.notes.push(format!(
            "axes that are nearly parallel meet their normal far away: rows of {:.0} m that cancel; keep every digit",
            rows.longest_m()
        ));
    }
    Ok(made)
}

impl Made {
    fn empty() -> Made {
        Made {
            text: Vec::new(),
            holds: Vec::new(),
            lacks: Vec::new(),
            by_hand: None,
            notes: Vec::new(),
            zeros: None,
        }
    }
}
