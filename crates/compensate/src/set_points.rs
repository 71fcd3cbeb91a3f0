//! One target after the other: the set-point of the nominal arm, the corrected one, and what each would reach.

use crate::arm::{Arm, observation_at};
use crate::crossing;
use crate::direction::{Way, invert_model};
use crate::inverse::{Limits, Miss};
use crate::set_point::{Kind, Reached, SetPoint};
use crate::{CompensateError, Conditions, Past, Target};
use armcal_core::Observation;
use nalgebra::Vector3;

/// Postures from which a solution is tried, at most.
const MOST_STARTS: usize = 6;
/// Everything but the targets.
#[derive(Debug, Clone)]
pub struct Compensator<'a> {
    /// The arm as the controller knows it: no effects, nominal geometry.
    pub nominal: Arm<'a>,
    /// The arm as calibrated, with its effects.
    pub calibrated: Arm<'a>,
    /// Under which conditions it is driven.
    pub conditions: Conditions,
    /// What each joint can do.
    pub limits: Limits,
    /// Postures the arm is known to take [rad]: a solution is looked for near the one that is nearest.
    pub postures_rad: Vec<Vec<f64>>,
    /// Range of each joint in the calibration [rad].
    pub recorded_rad: Vec<[f64; 2]>,
    /// Size of an approach before every target, all joints in their direction of travel [rad]; 0 for none.
    pub approach_rad: f64,
    /// Time in which a joint that turns back on a path crosses its gap [s]; 0 for one leap.
    pub crossing_s: f64,
}

/// Where the arm stands between two targets, and what the way there left behind: driven by nominal and by corrected set-points.
#[derive(Debug, Clone, PartialEq)]
pub struct Underway {
    nominal: Past,
    corrected: Past,
    /// The set-point it stands at; none where it was brought there otherwise.
    last: Option<SetPoint>,
}

impl Underway {
    /// The arm waits at `start_rad`, or nobody knows where: from where it came is not known.
    pub fn from(start_rad: Option<&[f64]>, joints: usize) -> Underway {
        let past = start_rad.map_or_else(|| Past::unknown(joints), Past::at);
        Underway { nominal: past.clone(), corrected: past, last: None }
    }

    /// Both went to these readings [rad].
    pub fn go(&mut self, joint_rad: &[f64]) {
        let [nominal, corrected] = [&self.nominal, &self.corrected].map(|past| past.then(joint_rad));
        *self = Underway { nominal, corrected, last: None };
    }

    /// What the arm that is driven by corrected set-points went through.
    pub fn past(&self) -> &Past {
        &self.corrected
    }
}

impl Compensator<'_> {
    /// A set-point for every target, in their order; each begins where the one before it ends.
    ///
    /// `start_rad` is where the arm waits before the first; without it the first directions of arrival are not known.
    ///
    /// # Errors
    /// The first target that cannot be reached or makes no sense, by name.
    pub fn set_points(
        &self,
        targets: &[Target],
        start_rad: Option<&[f64]>,
    ) -> Result<Vec<SetPoint>, CompensateError> {
        if targets.is_empty() {
            return Err(CompensateError::NoTargets);
        }
        targets.iter().try_for_each(|target| target.check(self.nominal.model.joint_count()))?;
        self.check(start_rad)?;
        let mut underway = Underway::from(start_rad, self.nominal.model.joint_count());
        let start = underway.corrected.clone();
        let mut out: Vec<SetPoint> = Vec::with_capacity(targets.len());
        for target in targets {
            out.extend(self.next(target, &mut underway)?);
        }
        self.cross(&mut out, start, &mut underway);
        Ok(out)
    }

    /// Spreads the leaps of a path that began after `start` over [`Compensator::crossing_s`], and says again what it reaches; the
    /// arm then stands at its end.
    pub fn cross(&self, path: &mut [SetPoint], start: Past, underway: &mut Underway) {
        if self.crossing_s > 0.0 && crossing::spread_leaps(path, self.crossing_s) {
            underway.corrected = self.predict_again(path, start);
            underway.last = path.last().cloned();
        }
    }

    /// The set-point of one target from where the arm stands, with the way to it in front where there is one; then it stands
    /// there. Gaps are crossed in one leap.
    ///
    /// # Errors
    /// A target that cannot be reached or makes no sense; the arm stands where it stood.
    pub fn next(&self, target: &Target, underway: &mut Underway) -> Result<Vec<SetPoint>, CompensateError> {
        let joints = self.nominal.model.joint_count();
        target.check(joints)?;
        let o = self.conditions.observation(target, joints);
        let follows = underway.last.is_some() && target.time_s.is_some();
        let stands_rad = if follows { underway.nominal.joint_rad() } else { None };
        let nominal = self.nominal_set_point(target, &o, stands_rad)?;
        self.corrected(target, nominal, underway)
    }

    /// What the models are asked about an arm at these readings [rad] after this past.
    pub fn observation(&self, past: &Past, joint_rad: &[f64]) -> Observation {
        let anywhere = Target::in_world("", Vector3::zeros(), None);
        observation_at(&self.conditions.observation(&anywhere, joint_rad.len()), past, joint_rad)
    }

    /// The same where the nominal set-point [rad] is known.
    ///
    /// # Errors
    /// As [`Compensator::next`].
    pub fn corrected(
        &self,
        target: &Target,
        nominal: Vec<f64>,
        underway: &mut Underway,
    ) -> Result<Vec<SetPoint>, CompensateError> {
        target.check(nominal.len())?;
        let o = self.conditions.observation(target, nominal.len());
        let Underway { nominal: nominal_past, corrected: past, last } = &*underway;
        let offs = self.approach(target, [nominal_past, past], &nominal);
        let [nominal_way, way] = [0, 1].map(|k| offs.as_ref().map_or(Way::Direct, |offs| Way::By(&offs[k])));
        // Travel is that of the nominal arm; from where the corrected one stands.
        let likely = match (past.joint_rad(), nominal_past.joint_rad()) {
            (Some(stands), Some(stood)) => add_travel(&stands, &stood, &nominal),
            _ => nominal.clone(),
        };
        let found = invert_model(&self.calibrated, &o, past, way, &likely, &self.limits)
            .or_else(|_| invert_model(&self.calibrated, &o, past, way, &nominal, &self.limits))
            .map_err(|miss| self.unreachable(target, "calibrated", &miss, 2))?;
        let nominal_after = nominal_way.past(nominal_past, &nominal);
        let mut out = Vec::with_capacity(2);
        if offs.is_some() {
            out.push(approach_point(target, nominal_way.via(&nominal), way.via(&found.joint_rad), past));
        }
        let before = self.calibrated.left(&o, &nominal_after, &nominal);
        let crossings = last.as_ref().filter(|_| target.time_s.is_some());
        let crossings = crossings.and_then(|last| self.crossings(last, &found, &nominal));
        let mut warnings = self.warnings(target, &o, past, &found, offs.is_some());
        warnings.extend(crossings);
        let point = SetPoint {
            target: target.clone(),
            kind: Kind::Target,
            nominal_rad: nominal,
            joint_rad: found.joint_rad,
            arrival: found.past.arrival(),
            in_gap: Vec::new(),
            reached: Some(Reached {
                before_m: before.0,
                after_m: found.left_m,
                turn_rad: target.has_orientation().then_some([before.1, found.left_rad]),
            }),
            warnings,
        };
        *underway = Underway { nominal: nominal_after, corrected: found.past, last: Some(point.clone()) };
        out.push(point);
        Ok(out)
    }

    /// What the calibrated model predicts for set-points that were changed, and what they leave behind.
    fn predict_again(&self, points: &mut [SetPoint], start: Past) -> Past {
        let mut past = start;
        for point in points {
            past = past.then(&point.joint_rad);
            point.arrival = past.arrival();
            let o = self.conditions.observation(&point.target, point.joint_rad.len());
            let (left_m, left_rad) = self.calibrated.left(&o, &past, &point.joint_rad);
            if let Some(reached) = &mut point.reached {
                reached.after_m = left_m;
                reached.turn_rad = reached.turn_rad.map(|[before, _]| [before, left_rad]);
            }
        }
        past
    }

    /// That limits and postures, and where the arm waits [rad], are those of this arm.
    ///
    /// # Errors
    /// Which are not.
    pub fn check(&self, start_rad: Option<&[f64]>) -> Result<(), CompensateError> {
        let joints = self.nominal.model.joint_count();
        let wrong = |what, problem: String| Err(CompensateError::BadJoints { what, problem });
        if let Some(start) = start_rad
            && (start.len() != joints || !start.iter().all(|q| q.is_finite()))
        {
            return wrong("start", format!("needs {joints} finite joint readings, one a joint"));
        }
        let Limits(limits) = &self.limits;
        if limits.len() != joints || !limits.iter().all(|[low, high]| low <= high) {
            return wrong("limits", format!("need {joints} ranges, each from low to high"));
        }
        let Compensator { postures_rad, recorded_rad, .. } = self;
        if recorded_rad.len() != joints || postures_rad.iter().any(|q| q.len() != joints) {
            return wrong("recorded postures", format!("need {joints} readings, one a joint"));
        }
        Ok(())
    }

    /// Inverse kinematics of the nominal arm: from where it stands on a path, else from the nearest known posture.
    fn nominal_set_point(
        &self,
        target: &Target,
        o: &Observation,
        stands_rad: Option<Vec<f64>>,
    ) -> Result<Vec<f64>, CompensateError> {
        let unknown = Past::unknown(self.nominal.model.joint_count());
        let mut nearest: Option<Miss> = None;
        let mut count = 0;
        for start in stands_rad.into_iter().chain(self.starts(o, &unknown)) {
            count += 1;
            match invert_model(&self.nominal, o, &unknown, Way::Direct, &start, &self.limits) {
                Ok(found) => return Ok(found.joint_rad),
                Err(miss) if nearest.as_ref().is_none_or(|n| miss.left_m < n.left_m) => nearest = Some(miss),
                Err(_) => {}
            }
        }
        let Some(nearest) = nearest else {
            let problem = "no posture to start from: give ranges of the joints".to_owned();
            return Err(CompensateError::BadJoints { what: "postures", problem });
        };
        Err(self.unreachable(target, "nominal", &nearest, count))
    }

    /// Where to start looking: known postures, nearest first, then the middle of what was recorded. Sorted only when
    /// somebody asks.
    fn starts<'s>(&'s self, o: &'s Observation, unknown: &'s Past) -> impl Iterator<Item = Vec<f64>> + 's {
        std::iter::once_with(move || {
            let off_m = |q: &Vec<f64>| self.nominal.left(o, &unknown.then(q), q).0;
            let mut starts: Vec<(f64, &Vec<f64>)> = self.postures_rad.iter().map(|q| (off_m(q), q)).collect();
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            let middle = self.recorded_rad.iter().map(|[low, high]| (low + high) / 2.0).collect();
            let known = starts.into_iter().map(|(_, q)| q.clone()).take(MOST_STARTS);
            known.chain([middle]).collect::<Vec<Vec<f64>>>()
        })
        .flatten()
    }

    /// How far before the target each joint passes on its way, for the nominal and the corrected set-point; `None`
    /// where the way is direct: on a path, or where nobody asks.
    fn approach(&self, target: &Target, pasts: [&Past; 2], nominal: &[f64]) -> Option<[Vec<f64>; 2]> {
        if self.approach_rad <= 0.0 || target.time_s.is_some() {
            return None;
        }
        let off = |past: &Past| {
            let signs = past.signs(nominal).into_iter().zip(&self.limits.0);
            let off = |(sign, [low, high]): (f64, &[f64; 2])| match low == high {
                // A joint that is held does not travel.
                true => 0.0,
                false if sign < 0.0 => -self.approach_rad,
                false => self.approach_rad,
            };
            signs.map(off).collect()
        };
        Some(pasts.map(off))
    }
}

/// `stands` moved by the way from `stood` to `to`.
fn add_travel(stands: &[f64], stood: &[f64], to: &[f64]) -> Vec<f64> {
    stands.iter().zip(stood.iter().zip(to)).map(|(q, (from, to))| q + (to - from)).collect()
}

fn approach_point(target: &Target, nominal_rad: Vec<f64>, joint_rad: Vec<f64>, before: &Past) -> SetPoint {
    let arrival = before.then(&joint_rad).arrival();
    let kind = Kind::Approach;
    SetPoint {
        target: target.clone(),
        kind,
        nominal_rad,
        joint_rad,
        arrival,
        in_gap: Vec::new(),
        reached: None,
        warnings: Vec::new(),
    }
}
