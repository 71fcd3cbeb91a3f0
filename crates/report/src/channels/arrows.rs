//! Error arrows, exaggerated by a stated factor and coloured by size; one topic a model, to be switched on and off.

use super::places::places_m;
use super::shapes::{Rgba, arrow, key_value, label, scene_entity};
use super::{Messages, start_ns, timestamp};
use armcal_result::analysis::round_factor;
use armcal_result::{Point, Run};
use foxglove::messages as fox;
use nalgebra::Vector3;

/// Which way every arrow of an error points, here, on the map of the boards and on the page.
pub(super) const POINTS: &str = "from where the model puts the tip to where it was";

pub(super) const INK: Rgba = [0.25, 0.25, 0.25, 1.0];

/// Longest arrow worth drawing beside an arm [m]; the 95th percentile of a set is kept below.
const LONG_ARROW_M: f64 = 0.05;
const THICKNESS_M: f64 = 0.0025;

/// Where an arrow begins and the error it shows: place of the tip, measured minus predicted [m].
type Error = fn(&Point) -> (Vector3<f64>, Vector3<f64>);

/// The models whose errors are drawn: topic and entity, and the error.
const NOMINAL: (&str, &str, Error) =
    ("/armcal/arrows_nominal", "errors/nominal", |p| (p.nominal_measured_m, p.residual.nominal_m));
const CALIBRATED: (&str, &str, Error) =
    ("/armcal/arrows_calibrated", "errors/calibrated", |p| (p.measured_m, p.residual.fitted_m));
const AFTER: (&str, &str, Error) = ("/armcal/arrows_after", "errors/after", |p| {
    (p.measured_m, p.steps_m.last().copied().unwrap_or(p.residual.fitted_m))
});

/// How errors of this run are drawn: the same for all its recordings.
pub(super) struct Drawing {
    nominal_factor: f64,
    /// Also that of the errors with everything found, so that the two can be compared.
    fitted_factor: f64,
    /// Whether the diagnosis found anything.
    found: bool,
    /// Error drawn in green [m].
    small_m: f64,
    /// Error drawn in red [m].
    large_m: f64,
    /// Where the scale is told [m]; none where nothing is seen.
    legend_m: Option<Vector3<f64>>,
}

/// The arrows of one recording; they replace those of the recording before.
pub(super) fn put(run: &Run, recording: usize, own: &[&Point], drawing: &Drawing, out: &mut Messages) {
    let time_ns = start_ns(&run.recordings[recording]);
    let mut sets = vec![(NOMINAL, drawing.nominal_factor), (CALIBRATED, drawing.fitted_factor)];
    if drawing.found {
        sets.push((AFTER, drawing.fitted_factor));
    }
    for ((topic, id, error), factor) in sets {
        let mut entity = scene_entity(id, time_ns);
        entity.metadata.push(key_value("exaggeration", factor));
        entity.arrows.extend(own.iter().filter_map(|p| {
            let (measured_m, error_m) = error(p);
            arrow(&measured_m, &(error_m * factor), THICKNESS_M, drawing.ramp(error_m.norm()))
        }));
        out.put(
            topic,
            time_ns,
            &fox::SceneUpdate { deletions: vec![delete_all(time_ns)], entities: vec![entity] },
        );
    }
}

/// Everything that the topic has drawn so far goes.
pub(super) fn delete_all(time_ns: i64) -> fox::SceneEntityDeletion {
    fox::SceneEntityDeletion {
        timestamp: Some(timestamp(time_ns)),
        r#type: fox::scene_entity_deletion::Type::All as i32,
        id: String::new(),
    }
}

impl Drawing {
    pub fn of(run: &Run, all: &[Point]) -> Drawing {
        let nominal_m: Vec<f64> = all.iter().map(|p| p.residual.nominal_m.norm()).collect();
        let fitted_m: Vec<f64> = all.iter().map(|p| p.residual.fitted_m.norm()).collect();
        let positive = |x: f64| if x.is_finite() && x > 0.0 { x } else { 1e-6 };
        let small_m = positive(run.calibration.noise_floor_m);
        let p95_m = |norms_m: &[f64]| positive(armcal_core::robust::percentile(norms_m, 0.95));
        Drawing {
            nominal_factor: round_factor(LONG_ARROW_M / p95_m(&nominal_m)),
            fitted_factor: round_factor(LONG_ARROW_M / p95_m(&fitted_m)),
            found: !run.steps.is_empty(),
            small_m,
            large_m: p95_m(&nominal_m).max(10.0 * small_m),
            // The last of the places is the one of the legend.
            legend_m: places_m(run, all).pop(),
        }
    }

    /// Green at the declared noise, yellow between, red at the large nominal errors; logarithmic.
    pub fn ramp(&self, error_m: f64) -> Rgba {
        ramp(self.small_m, self.large_m, error_m)
    }

    /// The scale in words, above everything; short lines, because a panel cuts what is wider.
    pub fn legend(&self, time_ns: i64) -> Option<fox::SceneEntity> {
        let words = format!(
            "errors {POINTS}\n\
             nominal x {}, calibrated x {}\n\
             green {} mm, red {} mm and more",
            self.nominal_factor,
            self.fitted_factor,
            armcal_core::units::format_mm(self.small_m),
            armcal_core::units::format_mm(self.large_m)
        );
        let mut legend = scene_entity("scale", time_ns);
        legend.texts.push(label(&self.legend_m?, INK, words));
        Some(legend)
    }
}

/// Green for small, yellow between, red for large; logarithmic.
pub(super) fn ramp(small_m: f64, large_m: f64, error_m: f64) -> Rgba {
    let t = ((error_m / small_m).ln() / (large_m / small_m).ln()).clamp(0.0, 1.0);
    if t < 0.5 { [2.0 * t, 0.75, 0.15, 1.0] } else { [1.0, 1.5 * (1.0 - t), 0.15, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_point_one_way_here_on_the_page_and_in_the_guide() {
        let page = include_str!("../page/assets/where.js");
        let guide =
            include_str!("../../../../docs/foxglove.md").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(page.contains(POINTS) && guide.contains(POINTS));
    }

    #[test]
    fn colours_go_from_green_to_red() {
        let ramp = |error_m| ramp(1e-4, 1e-2, error_m);
        let (green, red) = (ramp(0.0), ramp(1.0));
        assert!(green[0] < 0.1 && green[1] > 0.7);
        assert!(red[0] > 0.9 && red[1] < 0.1);
        assert_eq!(ramp(1e-3)[0], 1.0);
    }
}
