//! One calibration as the page shows it: the run's own, a candidate's, or one asked for live.

use armcal_calibrate::{Calibration, Estimate, PairedDifference, SideErrors};
use armcal_core::ErrorStats;
use armcal_core::units::format_mm;
use armcal_diagnose::{DependsOn, EntersAt};
use armcal_model::Model;
use armcal_result::sensitivity::{
    Band, Basis, Channel, Group, Signature, bands, drivers_of, groups, signatures,
};
use armcal_result::{Column, Refit, Run, role_word};
use armcal_wording::{conclusion, estimate_shown, pool_story};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::{Value, json};

/// Everything on the page that depends on the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Shown {
    /// Effects in the model beyond the run's own.
    pub added: Vec<String>,
    /// All effects in the model.
    pub effects: Vec<String>,
    /// The result in one sentence.
    pub sentence: String,
    /// Errors on points that the fit saw.
    pub train: Value,
    /// Errors on points that it did not.
    pub holdout: Value,
    /// Mean error expected from the declared noise alone [mm].
    pub noise_floor_mm: f64,
    /// Against the run's own calibration, on the points both judge.
    pub change: Option<Value>,
    /// 1 where the fit that predicted a dwell did not see it.
    pub held_out: Vec<u8>,
    /// Size of the error of each dwell [mm].
    pub error_mm: Column,
    /// Measured minus predicted, in the world [mm]: x, y, z.
    pub world_mm: [Column; 3],
    /// The same along the arm, from the base to the tip [mm].
    pub outward_mm: Column,
    /// The same in the board's frame [mm]: x, y; `null` for a tracked tip.
    pub board_mm: [Column; 2],
    /// Implied error of each channel that is drawn.
    pub implied: Vec<Column>,
    /// Their means along the drivers.
    pub bands: Vec<Band>,
    /// Mean errors of groups of dwells.
    pub groups: Vec<Group>,
    /// Every effect by itself.
    pub signatures: Vec<Signature>,
    /// All parameters.
    pub parameters: Vec<Value>,
}

impl Shown {
    /// The run's own calibration.
    pub fn of_run(run: &Run, basis: &Basis) -> Shown {
        let own =
            Refit { effects: Vec::new(), model: run.model.clone(), calibration: run.calibration.clone() };
        let shown = Shown::of(run, basis, &own);
        // What it is worth on another day was asked of the run's own calibration alone.
        Shown { sentence: shown.sentence + &pool_story::transfer_sentence(run), ..shown }
    }

    /// Another calibration of the run's observations.
    pub fn of(run: &Run, basis: &Basis, refit: &Refit) -> Shown {
        let Refit { effects: added, model, calibration } = refit;
        let residuals_m: Vec<Vector3<f64>> = calibration.residuals.iter().map(|r| r.fitted_m).collect();
        let error_mm: Vec<f64> = residuals_m.iter().map(|r| r.norm() * 1e3).collect();
        let any_held_out = calibration.residuals.iter().any(|r| r.held_out);
        let judged = calibration.residuals.iter().zip(&error_mm);
        let judged: Vec<Option<f64>> =
            judged.map(|(r, e)| (r.held_out || !any_held_out).then_some(*e)).collect();
        let channels = basis.sensitivity.channels.len();
        let drawn: Vec<usize> =
            (0..channels).filter(|c| !is_world(&basis.sensitivity.channels[*c])).collect();
        let implied: Vec<Vec<Option<f64>>> =
            drawn.iter().map(|c| basis.sensitivity.implied(*c, &residuals_m)).collect();
        let in_board = |axis: usize| {
            let each = residuals_m.iter().zip(&basis.into_board);
            Column::of(each.map(|(r, turn)| turn.as_ref().map(|turn| (turn * r)[axis] * 1e3)))
        };
        Shown {
            added: added.clone(),
            effects: effect_names(model),
            sentence: conclusion(calibration),
            train: side_json(&calibration.train),
            holdout: side_json(&calibration.holdout),
            noise_floor_mm: calibration.noise_floor_m * 1e3,
            change: change_json(run, calibration),
            held_out: calibration.residuals.iter().map(|r| u8::from(r.held_out)).collect(),
            error_mm: Column::of_all(error_mm),
            world_mm: [0, 1, 2].map(|axis| Column::of_all(residuals_m.iter().map(|r| r[axis] * 1e3))),
            outward_mm: Column::of_all(residuals_m.iter().zip(&basis.outwards).map(|(r, d)| r.dot(d) * 1e3)),
            board_mm: [in_board(0), in_board(1)],
            bands: drawn.iter().zip(&implied).flat_map(|(c, i)| bands(basis, *c, i)).collect(),
            implied: implied.into_iter().map(Column::of).collect(),
            groups: groups(run, basis, &judged),
            signatures: signatures(run, basis, refit),
            parameters: calibration.fit.estimates.iter().map(parameter_json).collect(),
        }
    }
}

/// Drivers drawn for each channel that has implied errors on the page.
pub(crate) fn drawn_drivers(basis: &Basis) -> Vec<Vec<DependsOn>> {
    let drawn = basis.sensitivity.channels.iter().take_while(|c| !is_world(c));
    drawn.enumerate().map(|(c, _)| drivers_of(basis, c)).collect()
}

/// Whether a channel is an axis of the world.
fn is_world(channel: &Channel) -> bool {
    matches!(channel.key, EntersAt::WorldAxis(_))
}

/// The effects of a model as a pipeline names them.
pub(crate) fn effect_names(model: &Model) -> Vec<String> {
    model.effects().iter().map(|e| e.spec.to_string()).collect()
}

/// Errors of one side of the hold-out [mm], the mean also as people read it.
fn side_json(errors: &SideErrors) -> Value {
    let of = |stats: &ErrorStats| {
        (stats.n > 0).then(|| {
            json!({
                "mean": stats.mean_m * 1e3,
                "rms": stats.rms_m * 1e3,
                "p95": stats.p95_m * 1e3,
                "max": stats.max_m * 1e3,
                "mean_text": format_mm(stats.mean_m),
            })
        })
    };
    json!({ "n": errors.fitted.n, "nominal_mm": of(&errors.nominal), "fitted_mm": of(&errors.fitted) })
}

/// Paired difference to the run's own calibration [mm].
fn change_json(run: &Run, after: &Calibration) -> Option<Value> {
    let d = PairedDifference::between(&run.observations, &run.calibration, after)?;
    let mm = |m: f64| m * 1e3;
    Some(json!({
        "difference_mm": mm(d.difference_m),
        "ci95_mm": d.ci95_m[0].is_finite().then_some(d.ci95_m.map(mm)),
        "better": d.better,
        "worse": d.worse,
    }))
}

/// A parameter as the page shows it, in the unit for people.
fn parameter_json(e: &Estimate) -> Value {
    let p = &e.parameter;
    let [nominal, value, change, half] = estimate_shown(e);
    json!({
        "name": p.name,
        "meaning": p.meaning,
        "unit": p.unit.display_symbol(),
        "nominal": nominal,
        "value": value,
        "change": change,
        // Half of the 95 % interval; empty for a fixed one.
        "half": if p.free { half } else { String::new() },
        "role": role_word(p.role),
        "free": p.free,
        "determined": e.determined,
        "at_bound": e.at_bound,
    })
}
