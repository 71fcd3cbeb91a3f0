//! The fit problem as every solver gets it: the same dwells, whitened alike, the same priors and bounds.
//!
//! Written twice, as JSON for scipy and as plain numbers for Ceres; the cost at anybody's answer is judged by one function.

use crate::Result;
use armcal_calibrate::{FitConfig, Objective, WhitenedProblem, position_covariance_m2, whitened_problem};
use armcal_core::{Observation, Parameter};
use armcal_lab::scenario::{Design, Scenario};
use armcal_model::Model;
use armcal_score::nominal_model;
use nalgebra::{DVector, Matrix3};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Parameters of each Ceres block: the base, the DH rows, the tip.
const BASE: [&str; 6] = ["base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz"];
const TIP: [&str; 3] = ["tip.x", "tip.y", "tip.z"];
const ROW: [&str; 4] = ["theta", "d", "a", "alpha"];

/// The paper's experiment on the quick path of the lab: 198 dwells in three tilts, nothing hidden.
pub struct Session {
    pub model: Model,
    pub observations: Vec<Observation>,
    /// DH rows in order: name, and the index of the joint that turns it.
    rows: Vec<(String, Option<usize>)>,
}

impl Session {
    pub fn observe() -> Result<Session> {
        let observed = Scenario::new("nothing", Design::ThreeTiltsBothWays, 1).observe()?;
        let model = nominal_model(&observed.nominal)?;
        let mut joints = 0..;
        let names = model.parameters().iter().filter_map(|p| p.name.strip_suffix(".theta"));
        let rows = names.enumerate().map(|(i, name)| {
            // The arm of the lab: every row turns but the last, which is the tool.
            (name.to_owned(), (i < model.joint_count()).then(|| joints.next()).flatten())
        });
        let rows = rows.collect();
        Ok(Session { model, observations: observed.observations, rows })
    }

    /// The problem with one objective.
    pub fn problem(&self, objective: Objective) -> Result<Problem<'_>> {
        let config = FitConfig { objective, ..FitConfig::default() };
        let judge = whitened_problem(&self.model, &self.observations, &config)?;
        Ok(Problem { session: self, config, judge })
    }
}

/// The session with one objective.
pub struct Problem<'a> {
    session: &'a Session,
    pub config: FitConfig,
    judge: WhitenedProblem<'a>,
}

/// A dwell, its measured point in the world [m], and what whitens its residual.
type Weighted<'a> = (&'a Observation, [f64; 3], Matrix3<f64>);

impl Problem<'_> {
    /// Free parameters.
    pub fn free(&self) -> usize {
        self.judge.names().len()
    }

    /// Cost at parameters given in the order of the model: whitened rows and priors, halved squares, Huber where robust.
    pub fn cost(&self, values: &[f64]) -> Result<f64> {
        let mut x = Vec::new();
        for (name, (scale, centre)) in self.judge.names().iter().zip(self.judge.scale_and_centre()) {
            let index = self.session.model.index(name).ok_or("a parameter lost its name")?;
            x.push((values[index] - centre) / scale);
        }
        Ok(0.5 * self.judge.residual(&DVector::from_vec(x))?.norm_squared())
    }

    /// Huber's constant for the norm of a 3-vector, which is 95 % efficient where `huber_c` is for a scalar
    /// (armcal-calibrate, `loss`); 0 for plain squares.
    fn huber_c(&self) -> f64 {
        match self.config.objective {
            Objective::Robust => self.config.huber_c * 1.627_987_99 / 1.344_997_51,
            _ => 0.0,
        }
    }

    /// Every dwell, at nominal: the boards are given.
    fn dwells(&self) -> Result<Vec<Weighted<'_>>> {
        let (model, nominal) = (&self.session.model, self.session.model.nominal());
        let dwell = |o| {
            let covariance = position_covariance_m2(model, &nominal, o);
            let factor = covariance.cholesky().ok_or("a covariance is not positive")?.unpack();
            let whitener = factor.try_inverse().ok_or("a covariance is not positive")?;
            Ok((o, model.measured_tip_in_world(&nominal, o).into(), whitener))
        };
        self.session.observations.iter().map(dwell).collect()
    }

    /// For scipy.
    pub fn json(&self) -> Result<Value> {
        // Infinite bounds become null.
        let parameter = |p: &Parameter| {
            json!({"name": p.name, "nominal": p.nominal, "prior_sigma": p.prior_sigma, "free": p.free,
                   "lower": p.lower, "upper": p.upper})
        };
        let rows = self.session.rows.iter().map(|(name, joint)| json!({"name": name, "joint": joint}));
        let dwells = self.dwells()?.into_iter().map(|(o, measured_m, whitener)| {
            json!({"joint_rad": o.joint_rad, "measured_m": measured_m, "whitener": rows_of(&whitener)})
        });
        let nominal = self.session.model.nominal();
        let base = self.session.model.base_in_world(&nominal).rotation.to_rotation_matrix();
        Ok(json!({
            "parameters": self.session.model.parameters().iter().map(parameter).collect::<Vec<_>>(),
            "rows": rows.collect::<Vec<_>>(),
            "base_rotation": rows_of(base.matrix()),
            "observations": dwells.collect::<Vec<_>>(),
            "huber_c": self.huber_c(),
            "sigma_scale": self.judge.sigma_scale(),
        }))
    }

    /// For Ceres, in the order that its program reads.
    pub fn numbers(&self) -> Result<String> {
        let model = &self.session.model;
        let mut text = format!("{:?} {:?}\n", self.huber_c(), self.judge.sigma_scale());
        let base = model.base_in_world(&model.nominal()).rotation.to_rotation_matrix();
        text += &line(rows_of(base.matrix()).as_flattened());
        for block in self.blocks()? {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", block.len());
            for p in block.iter().map(|&index| &model.parameters()[index]) {
                let sigma = p.prior_sigma.unwrap_or(f64::INFINITY);
                text += &line(&[p.nominal, sigma, p.lower, p.upper, f64::from(p.free)]);
            }
        }
        let dwells = self.dwells()?;
        let _ = writeln!(text, "{}", dwells.len());
        for (o, measured_m, whitener) in dwells {
            let angle = |joint: &Option<usize>| joint.map_or(0.0, |j| o.joint_rad[j]);
            text += &line(&self.session.rows.iter().map(|(_, joint)| angle(joint)).collect::<Vec<_>>());
            text += &line(&measured_m);
            text += &line(rows_of(&whitener).as_flattened());
        }
        Ok(text)
    }

    /// Ceres' answer in the order of the model.
    pub fn in_own_order(&self, values: &[f64]) -> Result<Vec<f64>> {
        let mut all = self.session.model.nominal();
        for (index, value) in self.blocks()?.into_iter().flatten().zip(values) {
            all[index] = *value;
        }
        Ok(all)
    }

    /// Index in the model of every parameter of every block.
    fn blocks(&self) -> Result<Vec<Vec<usize>>> {
        let rows = self.session.rows.iter();
        let rows = rows.map(|(name, _)| ROW.map(|quantity| format!("{name}.{quantity}")).to_vec());
        let frame = |names: &[&str]| names.iter().map(|&n| n.to_owned()).collect::<Vec<String>>();
        let names = [frame(&BASE)].into_iter().chain(rows).chain([frame(&TIP)]);
        let index = |name: &String| {
            self.session.model.index(name).ok_or_else(|| format!("the model has no `{name}`").into())
        };
        names.map(|block| block.iter().map(index).collect()).collect()
    }
}

fn rows_of(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]))
}

/// Numbers with all their digits.
fn line(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ") + "\n"
}
