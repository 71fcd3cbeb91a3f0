//! What the user should know of a set-point, and why there is none.

use crate::arm::observation_at;
use crate::crossing::leap_rad;
use crate::direction::Found;
use crate::inverse::Miss;
use crate::set_point::SetPoint;
use crate::set_points::Compensator;
use crate::{CompensateError, Past, Target};
use armcal_core::{Arrival, Observation, Unit};

/// Moves shorter than this may end on either flank of a gap, depending on how a servo overshoots [rad].
const SHORT_MOVE_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// A direction that moves the tip by less is not worth a word [m].
const TELLING_M: f64 = 0.05e-3;
/// A joint this far beyond what was recorded is extrapolated [rad].
const BEYOND_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
impl Compensator<'_> {
    /// About one target.
    pub(crate) fn warnings(
        &self,
        target: &Target,
        o: &Observation,
        before: &Past,
        found: &Found,
        approached: bool,
    ) -> Vec<String> {
        let mut out = Vec::new();
        let names = self.nominal.model.chain().joint_names();
        let moving = self.nominal.model.joints_to(self.conditions.feature);
        for (j, q) in found.joint_rad.iter().enumerate().filter(|(j, _)| moving.contains(j)) {
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
            let o = observation_at(o, &found.past.arriving(q, &signs), q);
            self.calibrated.model.predicted_tip_in_world(&self.calibrated.values, &o)
        };
        (tip_m(1.0) - tip_m(-1.0)).norm()
    }

    /// On a path: the joints that go further than the nominal ones, over a gap.
    pub(crate) fn crossings(&self, last: &SetPoint, found: &Found, nominal: &[f64]) -> Option<String> {
        let names = self.nominal.model.chain().joint_names();
        let crossing = |j: usize| {
            let before = [last.nominal_rad[j], last.joint_rad[j]];
            let size = leap_rad(before, [nominal[j], found.joint_rad[j]])?;
            Some(format!(
                "{} turns back and goes {} further to cross its gap",
                names[j],
                self.amount(j, size.abs())
            ))
        };
        let all: Vec<String> = (0..names.len()).filter_map(crossing).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }

    /// A joint's travel for people.
    fn amount(&self, joint: usize, value: f64) -> String {
        let unit = self.nominal.model.chain().joint_unit(joint);
        format!("{:.2} {}", unit.to_display(value), unit.display_symbol())
    }

    /// The error for a target that the iteration missed from `starts` postures.
    pub(crate) fn unreachable(
        &self,
        target: &Target,
        arm: &'static str,
        miss: &Miss,
        starts: usize,
    ) -> CompensateError {
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
