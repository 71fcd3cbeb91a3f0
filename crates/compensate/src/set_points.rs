//! One target after the other: the set-point of the nominal arm, the corrected one, and what each would reach.

use crate::direction::{Found, Way, invert};
use crate::inverse::{Limits, Miss};
use crate::{CompensateError, Conditions, Past, Target};
use armcal_core::{Arrival, Observation, Unit};
use armcal_model::{Model, ModelResidual};
use nalgebra::DMatrix;

/// Postures from which a solution is tried, at most.
const MOST_STARTS: usize = 6;
/// Moves shorter than this may end on either flank of a gap, depending on how a servo overshoots [rad].
const SHORT_MOVE_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// A direction that moves the tip by less is not worth a word [m].
const TELLING_M: f64 = 0.05e-3;
/// A joint this far beyond what was recorded is extrapolated [rad].
const BEYOND_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A set-point that leaps by this much more than the nominal one crosses a gap [rad].
const LEAP_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// A model and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm<'a> {
    /// The model.
    pub model: &'a Model,
    /// A value for each of its parameters.
    pub values: Vec<f64>,
}

impl Arm<'_> {
    pub(crate) fn linearised(
        &self,
        target: &Observation,
        past: &Past,
        q: &[f64],
    ) -> (ModelResidual, DMatrix<f64>) {
        self.model.residual_with_joint_jacobian(&self.values, &at(target, past, q))
    }

    /// What is left to the target after this past: distance [m] and rotation [rad].
    pub(crate) fn left(&self, target: &Observation, past: &Past, q: &[f64]) -> (f64, f64) {
        let residual = self.model.residual(&self.values, &at(target, past, q));
        (residual.position_m.norm(), residual.rotation_rad.map_or(0.0, |r| r.norm()))
    }
}

/// The target with readings and their past.
fn at(target: &Observation, past: &Past, q: &[f64]) -> Observation {
    let mut o = target.clone();
    past.clone().into_observation(q, &mut o);
    o
}

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
}

/// What a row of the output is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A target.
    Target,
    /// A point on the way to the target that follows, from which every joint moves in a known direction.
    Approach,
}

/// What the calibrated model predicts for a target.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// Error of the tip at the nominal set-point [m].
    pub before_m: f64,
    /// The same at the corrected one [m].
    pub after_m: f64,
    /// Error of the orientation at both [rad], where one was asked for.
    pub turn_rad: Option<[f64; 2]>,
}

/// A set-point.
#[derive(Debug, Clone, PartialEq)]
pub struct SetPoint {
    /// The target.
    pub target: Target,
    /// Whether this is the target or the way to it.
    pub kind: Kind,
    /// What a controller with the nominal model commands [rad] (sliding: [m]).
    pub nominal_rad: Vec<f64>,
    /// What brings the tip there [rad] (sliding: [m]).
    pub joint_rad: Vec<f64>,
    /// Direction in which each joint arrives at the corrected set-point.
    pub arrival: Vec<Arrival>,
    /// What both reach; `None` for an approach.
    pub reached: Option<Reached>,
    /// What the user should know.
    pub warnings: Vec<String>,
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
        self.check(targets, start_rad)?;
        let joints = self.nominal.model.joint_count();
        let start = start_rad.map_or_else(|| Past::unknown(joints), Past::at);
        let mut pasts = [start.clone(), start];
        let mut out: Vec<SetPoint> = Vec::with_capacity(targets.len());
        for (i, target) in targets.iter().enumerate() {
            let follows = i > 0 && target.time_s.is_some();
            let [nominal_past, past] = &pasts;
            let o = self.conditions.observation(target, joints);
            let nominal =
                self.nominal_set_point(target, &o, if follows { nominal_past.joint_rad() } else { None })?;
            let offs = self.approach(target, [nominal_past, past], &nominal);
            let [nominal_way, way] =
                [0, 1].map(|k| offs.as_ref().map_or(Way::Direct, |offs| Way::By(&offs[k])));
            let found = invert(&self.calibrated, &o, past, way, &nominal, &self.limits)
                .map_err(|miss| self.unreachable(target, "calibrated", &miss, 1))?;
            let nominal_after = nominal_way.past(nominal_past, &nominal);
            if offs.is_some() {
                out.push(approach_point(target, nominal_way.via(&nominal), way.via(&found.joint_rad), past));
            }
            let before = self.calibrated.left(&o, &nominal_after, &nominal);
            let leap = out.last().filter(|_| follows).and_then(|last| self.leap(last, &found, &nominal));
            let mut warnings = self.warnings(target, &o, past, &found, offs.is_some());
            warnings.extend(leap);
            out.push(SetPoint {
                target: target.clone(),
                kind: Kind::Target,
                nominal_rad: nominal,
                joint_rad: found.joint_rad,
                arrival: found.past.arrival(),
                reached: Some(Reached {
                    before_m: before.0,
                    after_m: found.left_m,
                    turn_rad: target.has_orientation().then_some([before.1, found.left_rad]),
                }),
                warnings,
            });
            pasts = [nominal_after, found.past];
        }
        Ok(out)
    }

    fn check(&self, targets: &[Target], start_rad: Option<&[f64]>) -> Result<(), CompensateError> {
        let joints = self.nominal.model.joint_count();
        if targets.is_empty() {
            return Err(CompensateError::NoTargets);
        }
        targets.iter().try_for_each(|target| target.check(joints))?;
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
            match invert(&self.nominal, o, &unknown, Way::Direct, &start, &self.limits) {
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
            let signs = past.signs(nominal).into_iter().take(nominal.len());
            signs.map(|sign| if sign < 0.0 { -self.approach_rad } else { self.approach_rad }).collect()
        };
        Some(pasts.map(off))
    }

    fn warnings(
        &self,
        target: &Target,
        o: &Observation,
        before: &Past,
        found: &Found,
        approached: bool,
    ) -> Vec<String> {
        let mut out = Vec::new();
        let names = self.nominal.model.chain().joint_names();
        for (j, q) in found.joint_rad.iter().enumerate() {
            let [low, high] = self.recorded_rad[j];
            let beyond = (low - q).max(q - high);
            if beyond > BEYOND_RAD {
                let amount = self.amount(j, beyond);
                out.push(format!(
                    "{} is {amount} beyond what was recorded: the correction is extrapolated",
                    names[j]
                ));
            }
            let matters_m = self.direction_matters_m(o, found, j);
            if matters_m < TELLING_M {
                continue;
            }
            let up_to_mm = matters_m * 1e3;
            let stood = before.joint_rad();
            let travel = stood.map(|stood| (q - stood[j]).abs());
            if found.past.arrival()[j] == Arrival::Unknown {
                out.push(format!(
                    "from where {} comes is not known, which decides over {up_to_mm:.2} mm; say where the arm starts",
                    names[j]
                ));
            } else if let Some(travel) = travel
                && !approached
                && target.time_s.is_none()
                && travel < SHORT_MOVE_RAD
            {
                out.push(format!(
                    "{} moves by {} only: how the servo overshoots decides over up to {up_to_mm:.2} mm; approach it \
                     from further away",
                    names[j],
                    self.amount(j, travel)
                ));
            }
        }
        if !found.settled() {
            out.push(format!(
                "no direction of travel agrees with itself: {:.3} mm are left; approach it from further away",
                found.left_m * 1e3
            ));
        }
        out
    }

    /// How far apart the two directions of arrival of a joint put the tip [m].
    fn direction_matters_m(&self, o: &Observation, found: &Found, joint: usize) -> f64 {
        let q = &found.joint_rad;
        let mut signs = found.past.signs(q);
        let mut tip_m = |sign: f64| {
            signs[joint] = sign;
            let o = at(o, &found.past.arriving(q, &signs), q);
            self.calibrated.model.predicted_tip_in_world(&self.calibrated.values, &o)
        };
        (tip_m(1.0) - tip_m(-1.0)).norm()
    }

    /// On a path: the joints whose set-point leaps over a gap.
    fn leap(&self, last: &SetPoint, found: &Found, nominal: &[f64]) -> Option<String> {
        let names = self.nominal.model.chain().joint_names();
        let more = |j: &usize| {
            let step = found.joint_rad[*j] - last.joint_rad[*j];
            (step - (nominal[*j] - last.nominal_rad[*j])).abs()
        };
        let leaps: Vec<String> = (0..names.len())
            .filter(|j| more(j) > LEAP_RAD)
            .map(|j| format!("{} leaps by {} to cross its gap", names[j], self.amount(j, more(&j))))
            .collect();
        (!leaps.is_empty()).then(|| leaps.join(", "))
    }

    /// A joint's travel for people.
    fn amount(&self, joint: usize, value: f64) -> String {
        let unit = self.nominal.model.chain().joint_unit(joint);
        format!("{:.2} {}", unit.to_display(value), unit.display_symbol())
    }

    fn unreachable(&self, target: &Target, arm: &'static str, miss: &Miss, starts: usize) -> CompensateError {
        let chain = self.nominal.model.chain();
        let names: Vec<&str> = miss.at_limit.iter().map(|j| chain.joint_names()[*j].as_str()).collect();
        let advice = if names.is_empty() {
            let from = if starts > 1 { format!(", tried from {starts} postures") } else { String::new() };
            format!("it is out of reach or the arm is singular there{from}; move the target towards the base")
        } else {
            format!("{} at its limit; widen that range or move the target", names.join(" and "))
        };
        let shown = |(j, q): (usize, &f64)| {
            let unit = chain.joint_unit(j);
            let value = format!("{:.1}", unit.to_display(*q));
            if unit == Unit::Radian { value } else { format!("{value} {}", unit.display_symbol()) }
        };
        let joint_deg: Vec<String> = miss.joint_rad.iter().enumerate().map(shown).collect();
        CompensateError::Unreachable {
            target: target.name.clone(),
            arm,
            left_mm: miss.left_m * 1e3,
            left_deg: miss.left_rad.to_degrees(),
            joint_deg: joint_deg.join(", "),
            advice,
        }
    }
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
        reached: None,
        warnings: Vec::new(),
    }
}
