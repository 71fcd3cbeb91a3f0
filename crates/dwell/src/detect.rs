//! The dwells of one recording.

use armcal_core::{Code, Dwell, DwellId, PoseSamples, Samples, Severity, Stage, TipMeasurement, Warning};
use std::ops::Range;

use crate::history::History;
use crate::pauses::{Encoders, Pauses, Tip, find_pauses};
use crate::series::{check_joints, check_order, check_poses, seconds_between};
use crate::summary::{
    effective_of, effort_means, gauge_reading, joint_means, mean_temperature_c, tip_measurement,
};
use crate::{ClockAlignment, DwellConfig, DwellError};

const DOING: &str = "detecting dwells";

/// Looser floors than this are not proposed [deg]: that would be motion.
const LARGEST_FLOOR_DEG: f64 = 2.0;

/// Finds the pauses of the arm and summarises each.
///
/// A dwell is an interval in which every joint, and the tip where it was seen, stays within its own noise at
/// rest. Joints and temperature are on the robot's clock; the tip stream is brought to it by `clock`, or
/// taken to share it when there is none. Dwells come in order of time, numbered from 0.
///
/// # Errors
/// No joint rows, columns of different length, stamps that do not increase, a senseless configuration.
pub fn detect_dwells<'s>(
    recording: usize,
    samples: &'s Samples,
    clock: Option<&ClockAlignment>,
    config: &DwellConfig,
) -> Result<(Vec<Dwell>, Vec<Warning>), DwellError> {
    config.check()?;
    check_joints(&samples.joints, DOING)?;
    if let Some(tip) = &samples.tip {
        check_poses(tip, DOING, "tip")?;
    }
    for body in samples.bodies.values() {
        check_poses(body, DOING, "marker")?;
    }
    if let Some(temperature) = &samples.temperature {
        check_order(&temperature.time_ns, DOING, "temperature")?;
    }
    for gauge in samples.gauges.values() {
        check_order(&gauge.time_ns, DOING, "instrument")?;
    }
    let encoders = Encoders::of(&samples.joints, config);
    let timed = |seen: &'s PoseSamples| Tip::of(seen, clock, &samples.joints.time_ns, config);
    let tip = samples.tip.as_ref().filter(|t| !t.is_empty()).map(timed);
    let markers: Vec<(&String, Tip<'_>)> = samples
        .bodies
        .iter()
        .filter(|(_, body)| !body.is_empty())
        .map(|(name, body)| (name, timed(body)))
        .collect();
    // Where nothing sees the tip, a marker tells when the arm stands still.
    let still = tip.as_ref().or(markers.first().map(|(_, marker)| marker));
    let still = still.filter(|seen| config.use_tip && !seen.samples.is_one_a_stop());
    let found = find_pauses(&encoders, still, config);

    let summary =
        Summary { samples, encoders: &encoders, tip: tip.as_ref(), markers: &markers, clock, config };
    let history = History::of(&encoders, config);
    let mut dwells: Vec<Dwell> = Vec::with_capacity(found.rows.len());
    for (dwell, rows) in found.rows.iter().enumerate() {
        let creeps = found.crept_rad.contains_key(&dwell);
        dwells.push(summary.dwell(DwellId { recording, dwell }, rows, &history, creeps, dwells.last()));
    }
    let warnings = summary.warnings(&found, &dwells);
    Ok((dwells, warnings))
}

struct Summary<'a> {
    samples: &'a Samples,
    encoders: &'a Encoders<'a>,
    tip: Option<&'a Tip<'a>>,
    markers: &'a [(&'a String, Tip<'a>)],
    clock: Option<&'a ClockAlignment>,
    config: &'a DwellConfig,
}

impl Summary<'_> {
    fn dwell(
        &self,
        id: DwellId,
        rows: &Range<usize>,
        history: &History<'_>,
        creeps: bool,
        before: Option<&Dwell>,
    ) -> Dwell {
        let joints = &self.samples.joints;
        let (start_ns, end_ns) = (joints.time_ns[rows.start], joints.time_ns[rows.end - 1]);
        let means = joint_means(joints, rows, &self.encoders.step_rad, creeps);
        let joint_rad: Vec<f64> = means.iter().map(|m| m.mean).collect();
        let stream = self.samples.temperature.as_ref();
        Dwell {
            id,
            start_ns,
            end_ns,
            joint_spread_rad: means.iter().map(|m| m.spread).collect(),
            joint_sigma_rad: means.iter().map(|m| m.sigma).collect(),
            effort_nm: effort_means(joints, rows),
            samples: rows.len(),
            effective_samples: effective_of(&means),
            arrival: history.arrival(rows.start, &joint_rad),
            path_memory_rad: history.path_memory(rows.start, &joint_rad),
            pair_memory_rad: history.pair_memory(rows.start, &joint_rad),
            moved_rad: before.map(|before| moved_rad(&before.joint_rad, &joint_rad)),
            joint_rad,
            tip: self.tip.and_then(|tip| self.seen(tip, start_ns, end_ns, creeps)),
            markers: self
                .markers
                .iter()
                .filter_map(|(name, marker)| {
                    Some(((*name).clone(), self.seen(marker, start_ns, end_ns, creeps)?))
                })
                .collect(),
            temperature_c: stream
                .and_then(|t| mean_temperature_c(t, start_ns, end_ns, self.config.temperature_max_age_s)),
            gauges: self
                .samples
                .gauges
                .iter()
                .filter_map(|(name, read)| Some((name.clone(), gauge_reading(read, start_ns, end_ns)?)))
                .collect(),
        }
    }

    /// The frames of the tip, or of a marker, whose time lies in the dwell for certain, the error of the alignment considered.
    fn seen(&self, tip: &Tip<'_>, start_ns: i64, end_ns: i64, creeps: bool) -> Option<TipMeasurement> {
        let margin_s = self.clock.map_or(0.0, |c| {
            let at =
                tip.robot_ns.partition_point(|t| *t < start_ns).min(tip.robot_ns.len().saturating_sub(1));
            tip.samples.time_ns.get(at).map_or(0.0, |t| 2.0 * c.sigma_s(*t))
        });
        // A quarter of the dwell at most: a badly known clock is warned about where it was estimated.
        let margin_s = margin_s.min(0.25 * seconds_between(start_ns, end_ns));
        let margin_ns = (margin_s * 1e9) as i64;
        let first = tip.robot_ns.partition_point(|t| *t < start_ns.saturating_add(margin_ns));
        let end = tip.robot_ns.partition_point(|t| *t <= end_ns.saturating_sub(margin_ns));
        tip_measurement(tip.samples, first..end.max(first), self.config, creeps)
    }

    fn warnings(&self, found: &Pauses, dwells: &[Dwell]) -> Vec<Warning> {
        let subject = "dwells".to_owned();
        let say =
            |severity, code, message| Warning::new(severity, Stage::Dwell, code, subject.clone(), message);
        let mut warnings = Vec::new();
        if dwells.is_empty() {
            warnings.push(say(Severity::Inadequate, Code::NoDwells, self.why_none(found)));
        } else if found.too_short_s.len() > 3.max(dwells.len() / 2) {
            let longest_s = found.too_short_s.iter().copied().fold(0.0, f64::max);
            let message = format!(
                "{} pauses shorter than dwell.min_duration_s = {} s were ignored (the longest {longest_s:.2} s); \
                 {} were kept",
                found.too_short_s.len(),
                self.config.min_duration_s,
                dwells.len()
            );
            warnings.push(say(Severity::Notice, Code::ShortPauses, message));
        }
        warnings.extend(dwells.windows(2).filter_map(|pair| self.split(&pair[0], &pair[1])));
        warnings.extend(self.creep(found));
        let few = |d: &&Dwell| d.effective_samples < self.config.min_effective_samples && d.samples > 1;
        let varying = |d: &&Dwell| d.joint_spread_rad.iter().any(|s| *s > 0.0);
        let (of, least) = (dwells.len(), self.config.min_effective_samples);
        let poor = dwells.iter().filter(varying).filter(few);
        warnings.extend(dwell_notice(Code::FewEffectiveSamples, "dwells", poor, |n, list| {
            format!(
                "{n} dwells are worth fewer than {least} independent readings ({list}); their standard errors are rough, \
                 hold each pose longer"
            )
        }));
        let blind = dwells.iter().filter(|d| self.tip.is_some() && d.tip.is_none());
        warnings.extend(dwell_notice(Code::DwellWithoutTip, "dwells", blind, |n, list| {
            format!(
                "{n} of {of} dwells have no tip measurement, the sensor did not see the tip then ({list})"
            )
        }));
        // They keep what was seen of the others.
        let unseen = |(name, _): &(&String, Tip<'_>)| {
            let blind = dwells.iter().filter(|d| !d.markers.contains_key(*name));
            dwell_notice(Code::DwellWithoutMarker, &format!("marker {name}"), blind, |n, list| {
                format!(
                    "the sensor saw it in {} of {of} dwells, not in {list}; what else was seen then is used",
                    of - n
                )
            })
        };
        warnings.extend(self.markers.iter().filter_map(unseen));
        warnings
    }

    /// Dwells in which the arm gave way.
    fn creep(&self, found: &Pauses) -> Option<Warning> {
        let all = found.crept_rad.values().flat_map(|crept| crept.iter().copied().enumerate());
        let (joint, by_rad) = all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let name =
            self.samples.joints.names.get(joint).cloned().unwrap_or_else(|| format!("joint {}", joint + 1));
        let which: Vec<usize> = found.crept_rad.keys().copied().collect();
        let message = format!(
            "in {} of {} dwells the readings creep while the arm rests, {name} by up to {:.3} deg ({}); their last half is \
             taken, with what it still creeps in its standard error",
            which.len(),
            found.rows.len(),
            by_rad.abs().to_degrees(),
            list_dwells(&which)
        );
        Some(Warning::new(Severity::Notice, Stage::Dwell, Code::DwellCreeps, "dwells", message))
    }

    /// Two dwells at one pose with a broken stream between them were one.
    fn split(&self, before: &Dwell, after: &Dwell) -> Option<Warning> {
        let time_ns = &self.samples.joints.time_ns;
        let of = |t: i64| {
            let row = time_ns.partition_point(|s| *s < t);
            self.encoders.stretches.iter().position(|s| s.contains(&row))
        };
        let pairs = before.joint_rad.iter().zip(&after.joint_rad).zip(&self.encoders.enter_rad);
        let same_pose = pairs.into_iter().all(|((a, b), tolerance)| (a - b).abs() <= 2.0 * tolerance);
        (same_pose && of(before.end_ns) != of(after.start_ns)).then(|| {
            let message = format!(
                "one pause was split by a gap of {:.2} s in the joint stream; it counts as two dwells, and where \
                 the second was reached from is unknown",
                seconds_between(before.end_ns, after.start_ns)
            );
            Warning::new(Severity::Notice, Stage::Dwell, Code::DwellSplitByGap, after.id.to_string(), message)
        })
    }

    /// Why there is no dwell, and which setting would find some: tried, not guessed.
    fn why_none(&self, found: &Pauses) -> String {
        let config = self.config;
        let longest_s = found.too_short_s.iter().copied().fold(0.0, f64::max);
        if longest_s >= 0.5 * config.min_duration_s {
            return format!(
                "no dwells found: the arm stands still {} times, but never longer than {longest_s:.3} s; lower \
                 dwell.min_duration_s (now {} s)",
                found.too_short_s.len(),
                config.min_duration_s
            );
        }
        if config.use_tip && self.tip.is_some() {
            let without_tip = find_pauses(self.encoders, None, config).rows.len();
            if without_tip > 0 {
                return format!(
                    "no dwells found: the joints stand still {without_tip} times, but the tip stream does not; \
                     check the clock alignment, or set dwell.use_tip = false"
                );
            }
        }
        let mut joint_floor_deg = config.joint_floor_deg.max(1e-3);
        while joint_floor_deg < LARGEST_FLOOR_DEG {
            joint_floor_deg *= 2.0;
            let looser = DwellConfig { joint_floor_deg, ..config.clone() };
            let would = find_pauses(&Encoders::of(&self.samples.joints, &looser), None, &looser).rows.len();
            if would > 0 {
                return format!(
                    "no dwells found: the joints never rest for {} s; if they are meant to, \
                     dwell.joint_floor_deg = {joint_floor_deg} (now {}) would find {would}",
                    config.min_duration_s, config.joint_floor_deg
                );
            }
        }
        format!(
            "no dwells found: the arm moves all the time, or no stretch of {} s is unbroken",
            config.min_duration_s
        )
    }
}

/// What is to be noticed of some dwells, given how many and which; nothing of none.
fn dwell_notice<'d>(
    code: Code,
    subject: &str,
    dwells: impl Iterator<Item = &'d Dwell>,
    message: impl Fn(usize, String) -> String,
) -> Option<Warning> {
    let which: Vec<usize> = dwells.map(|d| d.id.dwell).collect();
    let told = || message(which.len(), list_dwells(&which));
    (!which.is_empty()).then(|| Warning::new(Severity::Notice, Stage::Dwell, code, subject, told()))
}

/// How far each joint went from one dwell to the next [rad].
fn moved_rad(from_rad: &[f64], to_rad: &[f64]) -> Vec<f64> {
    to_rad.iter().zip(from_rad).map(|(to, from)| to - from).collect()
}

/// The first few of a list of dwells, in words.
fn list_dwells(dwells: &[usize]) -> String {
    let shown: Vec<String> = dwells.iter().take(8).map(|d| d.to_string()).collect();
    let more = if dwells.len() > 8 { ", ..." } else { "" };
    format!("dwell {}{more}", shown.join(", "))
}

#[cfg(test)]
#[path = "detect_tests.rs"]
mod tests;
