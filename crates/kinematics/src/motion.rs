//! One arm on its way: where it stands, and what the way there left behind in its gears.

use crate::{CalibratedArm, Conditions, KinematicsError};
use armcal_compensate::{Compensator, ORIENTING_JOINTS, Past, SetPoint, TargetFrame, Underway, held_joints};
use armcal_core::{FeatureId, Observation, Pose};
use armcal_model::Model;
use nalgebra::{UnitQuaternion, Vector3};

/// Longest time in which a joint may be told to cross its gap [s].
const MOST_CROSSING_S: f64 = 10.0;

/// An arm on its way.
#[derive(Debug, Clone)]
pub struct Motion<'a> {
    arm: &'a CalibratedArm,
    compensator: Compensator<'a>,
    frame: TargetFrame,
    tip: FeatureId,
    /// Joints that stay where they are while the tip is brought to a target.
    held: Vec<usize>,
    /// What each joint can do.
    limits: Vec<[f64; 2]>,
    underway: Underway,
}

/// How the joints are driven, beside where they are; nothing of it has to be known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Driven<'a> {
    /// Direction of travel of each joint, +1 or -1, as if it had come from far away; 0: as it comes from where the arm stands.
    pub direction: Option<&'a [f64]>,
    /// Speed of each joint [rad/s] (sliding: [m/s]).
    pub velocity_radps: Option<&'a [f64]>,
    /// Measured effort of each joint [N m] (sliding: [N]); NaN of one without.
    pub effort_nm: Option<&'a [f64]>,
}

/// A place for the tip, in the frame of the conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position [m].
    pub position_m: Vector3<f64>,
    /// Orientation, of arms with six joints or more.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// When the tip should pass it [s]; absent: it stops there.
    pub time_s: Option<f64>,
}

impl CalibratedArm {
    /// The arm under these conditions, from where its joints come unknown.
    ///
    /// # Errors
    /// A condition that the model does not know, or that is no number.
    pub fn motion(&self, conditions: &Conditions) -> Result<Motion<'_>, KinematicsError> {
        let (tip, frame, drive) = self.drive(conditions)?;
        let compensator = Compensator::of_result(&self.file, &self.models, (tip, frame), &drive);
        compensator.check(None)?;
        Ok(Motion {
            arm: self,
            frame,
            tip,
            held: held_joints(&self.models.geometry, tip, &drive),
            limits: compensator.limits.0.clone(),
            underway: Underway::from(None, self.joint_count()),
            compensator,
        })
    }
}

impl Motion<'_> {
    /// The arm waits at these readings [rad], from where it came unknown; `None`: nobody knows where it waits.
    ///
    /// # Errors
    /// Readings that are not those of this arm.
    pub fn start(&mut self, joint_rad: Option<&[f64]>) -> Result<(), KinematicsError> {
        joint_rad.map_or(Ok(()), |q| self.check("joints", q))?;
        self.underway = Underway::from(joint_rad, self.arm.joint_count());
        Ok(())
    }

    /// The arm goes to these readings [rad], each joint one way.
    ///
    /// # Errors
    /// Readings that are not those of this arm.
    pub fn go(&mut self, joint_rad: &[f64]) -> Result<(), KinematicsError> {
        self.check("joints", joint_rad)?;
        self.underway.go(joint_rad);
        Ok(())
    }

    /// Where the arm stands [rad]; `None` where nobody knows.
    pub fn stands_rad(&self) -> Option<Vec<f64>> {
        self.underway.past().joint_rad()
    }

    /// The tip of the calibrated arm, effects included, were it to go to these readings [rad] from where it stands.
    ///
    /// # Errors
    /// Vectors that are not those of this arm.
    pub fn tip(&self, joint_rad: &[f64], driven: &Driven<'_>) -> Result<Pose, KinematicsError> {
        self.check("joints", joint_rad)?;
        let past = match driven.direction {
            Some(signs) => {
                self.check("directions", signs)?;
                let signs: Vec<f64> =
                    signs.iter().map(|s| if *s == 0.0 { 0.0 } else { s.signum() }).collect();
                self.underway.past().coming(joint_rad, &signs)
            }
            None => self.underway.past().then(joint_rad),
        };
        let mut o = self.compensator.observation(&past, joint_rad);
        if let Some(velocity) = driven.velocity_radps {
            self.check("velocities", velocity)?;
            o.joint_velocity_radps = Some(velocity.to_vec());
        }
        if let Some(effort) = driven.effort_nm {
            self.check_length("efforts", effort)?;
            o.effort_nm = Some(effort.to_vec());
        }
        let calibrated = &self.compensator.calibrated;
        Ok(self.framed(calibrated.model, &calibrated.values, &o))
    }

    /// The tip as a controller that knows nothing of the calibration has it at these readings [rad].
    ///
    /// # Errors
    /// Readings that are not those of this arm.
    pub fn nominal_tip(&self, joint_rad: &[f64]) -> Result<Pose, KinematicsError> {
        self.check("joints", joint_rad)?;
        let o = self.compensator.observation(&Past::unknown(joint_rad.len()), joint_rad);
        let nominal = &self.compensator.nominal;
        Ok(self.framed(nominal.model, &nominal.values, &o))
    }

    /// The set-point that brings the tip to where the nominal arm has it at these joints [rad]; then the arm stands there. Of
    /// arms with six joints or more the orientation too. With a time [s] it is a point of a path, otherwise a stop.
    ///
    /// # Errors
    /// A set-point out of reach or behind a limit; the arm stands where it stood.
    pub fn correct(&mut self, nominal_rad: &[f64], time_s: Option<f64>) -> Result<SetPoint, KinematicsError> {
        let at = self.nominal_tip(nominal_rad)?;
        let turned = (nominal_rad.len() >= ORIENTING_JOINTS).then_some(at.rotation);
        let place = (at.translation.vector, turned);
        let mut target = self.frame.target(&self.arm.models, self.tip, "the nominal set-point", place)?;
        target.time_s = time_s;
        self.hold(nominal_rad);
        let found = self.compensator.corrected(&target, nominal_rad.to_vec(), &mut self.underway)?;
        last_point(found)
    }

    /// The set-points of a path: as [`Motion::correct`] one after the other, each with its time [s], but a joint that turns back
    /// crosses its gap in `crossing_s` around that moment instead of in one leap (0: in one leap), as `armcal compensate` does
    /// on a path. The arm then stands at the end. Points on the way through a gap name the joint ([`SetPoint::in_gap`]).
    ///
    /// # Errors
    /// No points, times that do not rise, a point out of reach or behind a limit; the arm stands where it stood.
    pub fn path(
        &mut self,
        nominal_rad: &[impl AsRef<[f64]>],
        time_s: &[f64],
        crossing_s: f64,
    ) -> Result<Vec<SetPoint>, KinematicsError> {
        let wrong = |what, problem: String| Err(KinematicsError::argument(what, problem));
        if nominal_rad.is_empty() || nominal_rad.len() != time_s.len() {
            let problem = format!("{} points and {} times were given", nominal_rad.len(), time_s.len());
            return wrong("path", problem + "; as many as there are points, and one at least, are needed");
        }
        let is_late = |i: usize| time_s[i].is_finite() && (i == 0 || time_s[i - 1] < time_s[i]);
        if let Some(i) = (0..time_s.len()).find(|i| !is_late(*i)) {
            return wrong(
                "times",
                format!("that of point {i} is {}, not later than the one before", time_s[i]),
            );
        }
        if !(0.0..=MOST_CROSSING_S).contains(&crossing_s) {
            return wrong("crossing", format!("{crossing_s} is no time from 0 to {MOST_CROSSING_S} s"));
        }
        let start = self.underway.clone();
        let timed = nominal_rad.iter().zip(time_s);
        let points: Result<Vec<SetPoint>, KinematicsError> =
            timed.map(|(nominal, time_s)| self.correct(nominal.as_ref(), Some(*time_s))).collect();
        let mut points = points.inspect_err(|_| self.underway = start.clone())?;
        self.compensator.crossing_s = crossing_s;
        self.compensator.cross(&mut points, start.past().clone(), &mut self.underway);
        Ok(points)
    }

    /// The set-point that brings the tip to a place, as `armcal compensate` finds it for one target after the other; then the
    /// arm stands there. Where a joint turns back on a path, its gap is crossed in one leap: to spread it, one has to know what
    /// comes next ([`Motion::path`]).
    ///
    /// # Errors
    /// A place out of reach or behind a limit, a number that is none; the arm stands where it stood.
    pub fn set_point(&mut self, to: &Point) -> Result<SetPoint, KinematicsError> {
        let place = (to.position_m, to.orientation);
        let mut target = self.frame.target(&self.arm.models, self.tip, "the target", place)?;
        target.time_s = to.time_s;
        let stands_rad = self.stands_rad();
        if stands_rad.is_none() && !self.held.is_empty() {
            let problem =
                "joints off the way to the tip, or shared with another, stay where they are: say where";
            return Err(KinematicsError::argument("start", problem));
        }
        self.hold(stands_rad.as_deref().unwrap_or_default());
        last_point(self.compensator.next(&target, &mut self.underway)?)
    }

    /// Lets joints that are not to move stay where they are.
    fn hold(&mut self, at_rad: &[f64]) {
        self.compensator.limits.0.copy_from_slice(&self.limits);
        for joint in &self.held {
            self.compensator.limits.0[*joint] = [at_rad[*joint]; 2];
        }
    }

    /// A pose that a model predicts, in the frame of the conditions.
    fn framed(&self, model: &Model, values: &[f64], o: &Observation) -> Pose {
        let in_world = model.predicted_pose_in_world(values, o);
        match self.frame {
            TargetFrame::Base => {
                let models = &self.arm.models;
                models
                    .model
                    .arm_base_in_world(&models.values, models.model.arm_of(self.tip))
                    .inv_mul(&in_world)
            }
            TargetFrame::World | TargetFrame::Board(_) => in_world,
        }
    }

    fn check_length(&self, what: &'static str, given: &[f64]) -> Result<(), KinematicsError> {
        let joints = self.arm.joint_count();
        let problem = || format!("{} were given, the arm has {joints} joints", given.len());
        if given.len() == joints { Ok(()) } else { Err(KinematicsError::argument(what, problem())) }
    }

    fn check(&self, what: &'static str, given: &[f64]) -> Result<(), KinematicsError> {
        self.check_length(what, given)?;
        match given.iter().position(|v| !v.is_finite()) {
            Some(joint) => {
                let problem =
                    format!("that of {} is {}, no finite number", self.arm.joints()[joint], given[joint]);
                Err(KinematicsError::argument(what, problem))
            }
            None => Ok(()),
        }
    }
}

/// The target, which comes last.
fn last_point(points: Vec<SetPoint>) -> Result<SetPoint, KinematicsError> {
    points.into_iter().next_back().ok_or_else(|| armcal_compensate::CompensateError::NoTargets.into())
}
