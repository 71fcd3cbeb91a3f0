//! A board printed, or cut, to a wrong scale.

use super::*;

/// `kind = "board_scale"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardScale {
    /// By how much it is too large along each of its axes [%].
    pub percent: [f64; 3],
}

impl Mechanism for BoardScale {}

impl Hidden for BoardScale {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        self.percent.iter().try_for_each(|v| keys.within("percent", *v, [-20.0, 20.0]))
    }

    fn machine_board(&self, board: &mut Board) {
        for cavity in &mut board.cavities {
            cavity.true_m += cavity.true_m.component_mul(&Vector3::from(self.percent)) / 100.0;
        }
    }
}
