//! What is known before association: how wrong the model may be, what hovering means, and in which
//! order the cavities were meant to be visited.

use crate::keys::nearest_key;
use crate::{Board, TableError};
use serde::{Deserialize, Serialize};

/// Settings of [`associate`](crate::associate). All are priors or limits; the defaults suit an arm
/// whose Denavit-Hartenberg parameters are off by some 5 mm and 2 deg.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AssociationConfig {
    /// Mean error of the predicted tip over the board, per axis, one standard deviation [mm]. Default 30.
    pub offset_sigma_mm: f64,
    /// Apparent turn of the board by the model's error, per axis, one standard deviation [deg]. Default 3.
    pub rotation_sigma_deg: f64,
    /// Apparent scale and shear of the board by the model's error, one standard deviation. Default 0.03.
    pub shear_sigma: f64,
    /// Apparent curvature of the board by the model's error, one standard deviation [1/m]. Default 0.15.
    pub curvature_sigma_per_m: f64,
    /// Use the sensor's tip positions where most dwells have them. Default true.
    pub use_measured: bool,
    /// Unknown constant offset of the tracked marker from the tip, per axis, one standard deviation [mm].
    /// Default 30; set it to about 1 when the marker is the tip.
    pub marker_offset_sigma_mm: f64,
    /// Scatter of aligned tips about their cavities that is expected, per axis [mm]; the scatter itself
    /// is estimated from the data. Default 2.
    pub tip_sigma_mm: f64,
    /// Lowest pause above a cavity that is common for hovering [mm]; below half of it nothing hovers.
    /// Default 8.
    pub hover_min_mm: f64,
    /// Highest pause above a cavity that is still hovering [mm]. Default 60.
    pub hover_max_mm: f64,
    /// Dwells further than this from every cavity are in free space [mm]. Default 60.
    pub near_mm: f64,
    /// Probability below which an assignment is reported as ambiguous. Default 0.95.
    pub min_confidence: f64,
    /// Fewer seated dwells than this are warned about. Default 6.
    pub min_seated: usize,
    /// Largest share of dwells near the board that may stay unassigned without a warning. Default 0.2.
    pub max_unassigned_share: f64,
    /// Largest turn between a given board pose and the aligned one without a warning [deg]. Default 8.
    pub max_turn_deg: f64,
    /// Names of cavities in the order in which they were meant to be visited. Evidence, not law: it
    /// decides between explanations that are otherwise equal (which end of a symmetric board is which)
    /// and never overrules the positions. Default: none.
    pub visiting_order: Option<Vec<String>>,
    /// Rough direction of the board's normal in the world, for a board whose pose is unknown.
    /// Default up, [0, 0, 1].
    pub normal_in_world: [f64; 3],
    /// How far the normal of a board of unknown pose may be from that direction [deg]. Default 75;
    /// 180 allows any.
    pub max_normal_deg: f64,
}

impl Default for AssociationConfig {
    fn default() -> AssociationConfig {
        AssociationConfig {
            offset_sigma_mm: 30.0,
            rotation_sigma_deg: 3.0,
            shear_sigma: 0.03,
            curvature_sigma_per_m: 0.15,
            use_measured: true,
            marker_offset_sigma_mm: 30.0,
            tip_sigma_mm: 2.0,
            hover_min_mm: 8.0,
            hover_max_mm: 60.0,
            near_mm: 60.0,
            min_confidence: 0.95,
            min_seated: 6,
            max_unassigned_share: 0.2,
            max_turn_deg: 8.0,
            visiting_order: None,
            normal_in_world: [0.0, 0.0, 1.0],
            max_normal_deg: 75.0,
        }
    }
}

impl AssociationConfig {
    /// Checks the values against their ranges, and the visiting order against the board.
    pub(crate) fn check(&self, board: &Board) -> Result<(), TableError> {
        let bad = |what: String| Err(TableError::Config { what });
        for (key, value) in [
            ("offset_sigma_mm", self.offset_sigma_mm),
            ("rotation_sigma_deg", self.rotation_sigma_deg),
            ("shear_sigma", self.shear_sigma),
            ("curvature_sigma_per_m", self.curvature_sigma_per_m),
            ("marker_offset_sigma_mm", self.marker_offset_sigma_mm),
            ("tip_sigma_mm", self.tip_sigma_mm),
            ("hover_min_mm", self.hover_min_mm),
            ("near_mm", self.near_mm),
            ("max_turn_deg", self.max_turn_deg),
            ("max_normal_deg", self.max_normal_deg),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return bad(format!("{key} = {value} must be a finite number above 0"));
            }
        }
        if !(self.hover_max_mm.is_finite() && self.hover_max_mm > self.hover_min_mm) {
            return bad(format!(
                "hover_max_mm = {} must be above hover_min_mm = {}",
                self.hover_max_mm, self.hover_min_mm
            ));
        }
        if !(self.min_confidence > 0.5 && self.min_confidence < 1.0) {
            return bad(format!("min_confidence = {} must be between 0.5 and 1", self.min_confidence));
        }
        if !(0.0..=1.0).contains(&self.max_unassigned_share) {
            return bad(format!(
                "max_unassigned_share = {} must be between 0 and 1",
                self.max_unassigned_share
            ));
        }
        let normal: f64 = self.normal_in_world.iter().map(|v| v * v).sum();
        if !(normal.is_finite() && normal > 1e-12) {
            return bad(format!(
                "normal_in_world = {:?} must be a direction, not zero",
                self.normal_in_world
            ));
        }
        self.check_order(board)
    }

    fn check_order(&self, board: &Board) -> Result<(), TableError> {
        let names: Vec<&str> = board.cavities.iter().map(|c| c.name.as_str()).collect();
        for name in self.visiting_order.iter().flatten() {
            if board.cavity(name).is_none() {
                let hint =
                    nearest_key(name, &names).map(|n| format!(", did you mean `{n}`?")).unwrap_or_default();
                return Err(TableError::Config {
                    what: format!(
                        "visiting_order names `{name}`, which board `{}` does not have{hint}",
                        board.name
                    ),
                });
            }
        }
        Ok(())
    }
}
