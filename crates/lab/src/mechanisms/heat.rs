//! Links that grow as they get warm: `dL = L alpha (T - T0)`, with `T` from the thermometer or from a heat
//! balance of their own, `C dT/dt = P - G (T - T_room)`, integrated in time.

use super::*;

/// Longest step of the heat balance [s].
const STEP_S: f64 = 5.0;

/// `kind = "thermal_growth"`: the links have the temperature that the thermometer shows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalGrowth {
    /// The links that grow. Default 2 and 3.
    #[serde(default = "both")]
    pub links: Vec<usize>,
    /// Expansion [ppm/K]: 23 for aluminium, 70 for printed PLA.
    pub per_kelvin_ppm: f64,
    /// Growth at this moment [ppm].
    #[serde(skip)]
    pub(crate) grown_ppm: f64,
}

/// `kind = "warm_up"`: the motors heat the links, and no thermometer shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
    /// The links that grow. Default 2 and 3.
    #[serde(default = "both")]
    pub links: Vec<usize>,
    /// Expansion [ppm/K].
    pub per_kelvin_ppm: f64,
    /// How much warmer they get in the end [K].
    pub rise_k: f64,
    /// Time constant of their warming up, from the start of the session [s].
    pub time_constant_s: f64,
    /// How warm they are.
    #[serde(skip)]
    pub(crate) heat: Heat,
}

/// `kind = "room_temperature"`: an air conditioner cycles, and the links follow late.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoomTemperature {
    /// The links that grow. Default 2 and 3.
    #[serde(default = "both")]
    pub links: Vec<usize>,
    /// Expansion [ppm/K].
    pub per_kelvin_ppm: f64,
    /// How far the room swings to either side [K].
    pub swing_k: f64,
    /// Period [s].
    pub period_s: f64,
    /// How late the links follow [s].
    pub time_constant_s: f64,
    /// How warm they are.
    #[serde(skip)]
    pub(crate) heat: Heat,
}

/// Temperature above that at the start of the session, and when it was that.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Heat {
    pub(crate) above_k: f64,
    session_s: f64,
}

impl Heat {
    /// Goes on to `session_s` under `dT/dt = rate(T, t)` (Runge-Kutta, fourth order).
    pub(super) fn advance(&mut self, session_s: f64, rate: impl Fn(f64, f64) -> f64) {
        while self.session_s < session_s {
            let (t, h) = (self.session_s, (session_s - self.session_s).min(STEP_S));
            let k1 = rate(self.above_k, t);
            let k2 = rate(self.above_k + k1 * h / 2.0, t + h / 2.0);
            let k3 = rate(self.above_k + k2 * h / 2.0, t + h / 2.0);
            let k4 = rate(self.above_k + k3 * h, t + h);
            self.above_k += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * h / 6.0;
            self.session_s = if h < STEP_S { session_s } else { t + h };
        }
    }
}

fn both() -> Vec<usize> {
    vec![2, 3]
}

fn grow(arm: &mut AxisArm, links: &[usize], ppm: f64) {
    for link in links {
        let longer = arm.link_m(link - 1) * (ppm * 1e-6);
        arm.shift_beyond(link - 1, &longer);
    }
}

impl ThermalGrowth {
    fn read(&mut self, now: &RigState<'_>) {
        self.grown_ppm = self.per_kelvin_ppm * now.warmer_k;
    }
}

impl WarmUp {
    fn warm(&mut self, now: &RigState<'_>) {
        let (rise, time) = (self.rise_k, self.time_constant_s);
        self.heat.advance(now.session_s, |above, _| (rise - above) / time);
    }
}

impl RoomTemperature {
    fn warm(&mut self, now: &RigState<'_>) {
        let (swing, time) = (self.swing_k, self.time_constant_s);
        let turns = std::f64::consts::TAU / self.period_s;
        self.heat.advance(now.session_s, |above, t| (swing * (turns * t).sin() - above) / time);
    }
}

macro_rules! growing {
    ($name:ident, $advance:ident, $ppm:expr) => {
        impl Mechanism for $name {
            fn motor_to_link(&mut self, now: &RigState<'_>, _joint_rad: &mut [f64]) {
                self.$advance(now);
            }

            fn link_to_motor(&mut self, now: &RigState<'_>, _joint_rad: &mut [f64]) {
                self.$advance(now);
            }

            fn reshape_arm(&self, _now: &RigState<'_>, arm: &mut AxisArm) {
                grow(arm, &self.links, $ppm(self));
            }
        }
    };
}

growing!(ThermalGrowth, read, |m: &ThermalGrowth| m.grown_ppm);
growing!(WarmUp, warm, |m: &WarmUp| m.heat.above_k * m.per_kelvin_ppm);
growing!(RoomTemperature, warm, |m: &RoomTemperature| m.heat.above_k * m.per_kelvin_ppm);

fn check_links(keys: &Keys, links: &[usize], per_kelvin_ppm: f64) -> Result<(), LabError> {
    links.iter().try_for_each(|link| keys.joint("links", *link))?;
    keys.within("per_kelvin_ppm", per_kelvin_ppm, [0.0, 1e4])
}

impl Hidden for ThermalGrowth {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        check_links(keys, &self.links, self.per_kelvin_ppm)
    }
}

impl Hidden for WarmUp {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        check_links(keys, &self.links, self.per_kelvin_ppm)?;
        keys.within("rise_k", self.rise_k, [-100.0, 100.0])?;
        keys.within("time_constant_s", self.time_constant_s, [STEP_S, 1e6])
    }
}

impl Hidden for RoomTemperature {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        check_links(keys, &self.links, self.per_kelvin_ppm)?;
        keys.within("swing_k", self.swing_k, [0.0, 100.0])?;
        keys.within("period_s", self.period_s, [4.0 * STEP_S, 1e6])?;
        keys.within("time_constant_s", self.time_constant_s, [STEP_S, 1e6])
    }
}
