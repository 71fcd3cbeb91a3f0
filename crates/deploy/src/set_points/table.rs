//! Set-points as CSV, as JSON and for the terminal.

use super::unit_suffixes;
use crate::error::DeployError;
use armcal_compensate::{Kind, SetPoint};
use armcal_core::{Arrival, ErrorStats};
use armcal_model::Chain;
use armcal_report::{number_cell, plain_table, table_text};
use comfy_table::Cell;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Rows of the terminal's table; the file has all.
const SHOWN: usize = 40;

/// Set-points with what people need beside them.
#[derive(Debug, Clone)]
pub struct Sheet<'a> {
    /// The arm: names and units of its joints.
    pub chain: &'a Chain,
    /// The set-points.
    pub points: &'a [SetPoint],
    /// Their targets in the world [m].
    pub in_world_m: Vec<Vector3<f64>>,
    /// What concerns all of them.
    pub notes: Vec<String>,
}

/// Errors before and after over all targets [m].
pub fn target_errors(points: &[SetPoint]) -> [ErrorStats; 2] {
    let of = |pick: fn(&armcal_compensate::Reached) -> f64| {
        let all: Vec<f64> = points.iter().filter_map(|p| p.reached.as_ref().map(pick)).collect();
        ErrorStats::of_norms(&all)
    };
    [of(|r| r.before_m), of(|r| r.after_m)]
}

impl Sheet<'_> {
    /// One row a set-point. `nominal.<joint>` and `set_point.<joint>` are SI, corrections in display units.
    pub fn csv(&self) -> Result<Vec<u8>, DeployError> {
        let mut out = csv::Writer::from_writer(Vec::new());
        out.write_record(self.header())?;
        for (point, at) in self.points.iter().zip(&self.in_world_m) {
            out.write_record(self.row(point, at))?;
        }
        Ok(out.into_inner().map_err(|e| csv::Error::from(std::io::Error::other(e.to_string())))?)
    }

    fn joints(&self) -> impl Iterator<Item = (usize, &String, [&'static str; 2])> {
        let names = self.chain.joint_names().iter().enumerate();
        names.map(|(j, name)| (j, name, unit_suffixes(self.chain.joint_unit(j))))
    }

    fn header(&self) -> Vec<String> {
        let mut header: Vec<String> = ["name", "kind", "t_s", "x_m", "y_m", "z_m"].map(str::to_owned).into();
        header.extend(self.joints().map(|(_, name, [si, _])| format!("nominal.{name}_{si}")));
        header.extend(self.joints().map(|(_, name, [si, _])| format!("set_point.{name}_{si}")));
        header.extend(self.joints().map(|(_, name, [_, shown])| format!("correction.{name}_{shown}")));
        header.extend(self.joints().map(|(_, name, _)| format!("arrival.{name}_sign")));
        header.extend(["before_mm", "after_mm", "before_deg", "after_deg", "warnings"].map(str::to_owned));
        header
    }

    fn row(&self, point: &SetPoint, at: &Vector3<f64>) -> Vec<String> {
        let optional = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
        let mut row = vec![point.target.name.clone(), kind_name(point).into(), optional(point.target.time_s)];
        row.extend(at.iter().map(f64::to_string));
        row.extend(point.nominal_rad.iter().map(f64::to_string));
        row.extend(point.joint_rad.iter().map(f64::to_string));
        row.extend(self.corrections(point).map(|c| c.to_string()));
        row.extend(point.arrival.iter().map(|a| a.sign().to_string()));
        let reached = point.reached.as_ref();
        row.push(optional(reached.map(|r| r.before_m * 1e3)));
        row.push(optional(reached.map(|r| r.after_m * 1e3)));
        let turn = reached.and_then(|r| r.turn_rad);
        row.extend([0, 1].map(|k| optional(turn.map(|t| t[k].to_degrees()))));
        row.push(point.warnings.join("; "));
        row
    }

    /// Corrected minus nominal, for people.
    fn corrections<'p>(&'p self, point: &'p SetPoint) -> impl Iterator<Item = f64> + 'p {
        let pairs = point.joint_rad.iter().zip(&point.nominal_rad).enumerate();
        pairs.map(|(j, (q, nominal))| self.chain.joint_unit(j).to_display(q - nominal))
    }

    /// The same for programs.
    pub fn json(&self) -> Value {
        let [before, after] = target_errors(self.points);
        let point = |(p, at): (&SetPoint, &Vector3<f64>)| {
            json!({
                "name": p.target.name, "kind": kind_name(p), "t_s": p.target.time_s, "target_m": at.as_slice(),
                "nominal_rad": p.nominal_rad, "set_point_rad": p.joint_rad,
                "arrival": p.arrival.iter().map(|a| a.sign() as i32).collect::<Vec<i32>>(),
                "before_mm": p.reached.as_ref().map(|r| r.before_m * 1e3),
                "after_mm": p.reached.as_ref().map(|r| r.after_m * 1e3),
                "warnings": p.warnings,
            })
        };
        json!({
            "schema": "armcal.set_points/1",
            "joints": self.chain.joint_names(),
            "before_mm": {"mean": before.mean_m * 1e3, "max": before.max_m * 1e3},
            "after_mm": {"mean": after.mean_m * 1e3, "max": after.max_m * 1e3},
            "notes": self.notes,
            "set_points": self.points.iter().zip(&self.in_world_m).map(point).collect::<Vec<Value>>(),
        })
    }

    /// For the terminal.
    pub fn text(&self) -> String {
        let mut table = plain_table();
        let mut header = vec!["target".to_owned(), "x, y, z [mm]".to_owned()];
        let shown = |(_, name, [_, shown]): (usize, &String, [&str; 2])| format!("{name} [{shown}]");
        header.extend(self.joints().map(shown));
        header.extend(["correction", "arrive", "before [mm]", "after [mm]"].map(str::to_owned));
        table.set_header(header);
        for (point, at) in self.points.iter().zip(&self.in_world_m).take(SHOWN) {
            let mut cells = vec![Cell::new(&point.target.name), Cell::new(position_mm_text(at))];
            let units = |j: usize| self.chain.joint_unit(j);
            let joints = point.joint_rad.iter().enumerate();
            cells.extend(joints.map(|(j, q)| number_cell(format!("{:.3}", units(j).to_display(*q)))));
            let corrections: Vec<String> = self.corrections(point).map(|c| format!("{c:+.3}")).collect();
            cells.push(Cell::new(corrections.join(" ")));
            cells.push(Cell::new(point.arrival.iter().map(Arrival::symbol).collect::<String>()));
            match &point.reached {
                Some(r) => cells.extend([
                    number_cell(format!("{:.2}", r.before_m * 1e3)),
                    number_cell(format!("{:.3}", r.after_m * 1e3)),
                ]),
                None => cells.extend([Cell::new("on the way"), Cell::new("")]),
            }
            table.add_row(cells);
        }
        let mut text = table_text(&table);
        if self.points.len() > SHOWN {
            text += &format!("... and {} more in the file\n", self.points.len() - SHOWN);
        }
        let [before, after] = target_errors(self.points);
        text += &format!(
            "\nBy the calibrated model the tip would miss {} targets by {:.2} mm on average (at most {:.2}) at nominal \
             set-points, and by {:.3} mm (at most {:.3}) at these.\n",
            before.n,
            before.mean_m * 1e3,
            before.max_m * 1e3,
            after.mean_m * 1e3,
            after.max_m * 1e3
        );
        for line in self.warnings().iter().chain(&self.notes) {
            text += &format!("- {line}\n");
        }
        text
    }

    /// What is said of targets, each once with how many it is said of.
    fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let warned: Vec<&SetPoint> = self.points.iter().filter(|p| !p.warnings.is_empty()).collect();
        for point in warned.iter().take(SHOWN / 4) {
            lines.push(format!("{}: {}", point.target.name, point.warnings.join("; ")));
        }
        if warned.len() > SHOWN / 4 {
            lines.push(format!("warnings for {} more targets are in the file", warned.len() - SHOWN / 4));
        }
        lines
    }
}

fn kind_name(point: &SetPoint) -> &'static str {
    match point.kind {
        Kind::Target => "target",
        Kind::Approach => "approach",
    }
}

fn position_mm_text(at_m: &Vector3<f64>) -> String {
    at_m.iter().map(|v| format!("{:.1}", v * 1e3)).collect::<Vec<String>>().join(", ")
}
