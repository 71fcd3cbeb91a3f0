//! What the mean over a dwell makes of encoders, cameras and thermometer.

use crate::config::{EncoderConfig, LabConfig};
use crate::random::{Purpose, Stream};
use crate::sensors::outliers::{Swap, Tails, draw_swaps, swapped_m};
use armcal_core::{Pose, Reference};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// No mean position is believed to be better than this, per axis [m].
const FLOOR_M: f64 = 1e-5;

/// No mean orientation is believed to be better than this, about each axis [rad].
const FLOOR_RAD: f64 = 0.001 * std::f64::consts::PI / 180.0;

/// Readings that are really drawn: their mean is exact enough beyond.
pub const MOST_READINGS: f64 = 100.0;

/// Mean of so many readings of each joint [rad], and its standard error [rad].
pub(crate) fn mean_encoder_readings(
    joints: &EncoderConfig,
    joint_rad: &[f64],
    readings: f64,
    draw: &mut Stream,
) -> [Vec<f64>; 2] {
    let (count, readings) = (joints.count_rad(), readings.max(1.0).floor());
    let mean = |angle: &f64| {
        let counted =
            (0..readings as usize).map(|_| (angle / count + draw.normal() * joints.noise_counts).round());
        counted.sum::<f64>() / readings * count
    };
    // Counting adds the variance of a uniform error of one count.
    let sigma = count * ((joints.noise_counts.powi(2) + 1.0 / 12.0) / readings).sqrt();
    [joint_rad.iter().map(mean).collect(), vec![sigma; joint_rad.len()]]
}

/// The cameras and the thermometer of one recording.
pub struct Camera<'a> {
    config: &'a LabConfig,
    draw: Stream,
    tails: Tails,
    swaps: Vec<Swap>,
    slow: [Vector3<f64>; 2],
    slow_at_s: f64,
}

impl<'a> Camera<'a> {
    pub fn new(config: &'a LabConfig, recording: usize, duration_s: f64) -> Camera<'a> {
        let draw = Stream::new(config.seed, Purpose::Quick, 2 * recording + 1);
        Camera { swaps: draw_swaps(config, recording, duration_s), ..Camera::drawn(config, recording, draw) }
    }

    /// What sees a marker on a link; it is not swapped.
    pub fn of_marker(config: &'a LabConfig, recording: usize, marker: usize) -> Camera<'a> {
        let stream = marker * config.recordings.len() + recording;
        Camera::drawn(config, recording, Stream::new(config.seed, Purpose::QuickMarker, stream))
    }

    fn drawn(config: &'a LabConfig, recording: usize, mut draw: Stream) -> Camera<'a> {
        let slow = [draw.normal3(), draw.normal3()];
        Camera {
            config,
            draw,
            tails: Tails::new(&config.vicon, config.seed, recording),
            swaps: Vec::new(),
            slow,
            slow_at_s: 0.0,
        }
    }

    /// Mean pose of the tip, or of the marker, over a dwell, and the covariance that its own scatter suggests.
    pub fn tip(&mut self, truth: &Pose, span_s: [f64; 2]) -> (Reference, Matrix3<f64>) {
        let vicon = &self.config.vicon;
        let (mid_s, duration_s) = ((span_s[0] + span_s[1]) / 2.0, span_s[1] - span_s[0]);
        let frames = (duration_s * vicon.tip.rate_hz).max(3.0).floor();
        let white = (1.0 - vicon.correlated_share) / frames;
        let lag = duration_s / vicon.correlation_s;
        // Variance of the mean of an Ornstein-Uhlenbeck process over a window, as a share of its own.
        let kept = 2.0 / lag - 2.0 * (1.0 - (-lag).exp()) / (lag * lag);
        let slow = vicon.correlated_share * kept;
        // What hardly changes within the dwell does not show in its scatter.
        let shown = white + slow * (1.0 - kept);

        let keep = (-(mid_s - self.slow_at_s) / vicon.correlation_s).exp();
        self.slow_at_s = mid_s;
        let slow_draw = &mut self.draw;
        let ahead = |state: Vector3<f64>, draw: &mut Stream| {
            state * keep + draw.normal3() * (1.0 - keep * keep).sqrt()
        };
        self.slow = self.slow.map(|state| ahead(state, slow_draw));
        let [shift, turn] = self.slow.map(|state| slow_draw.normal3() * white.sqrt() + state * slow.sqrt());

        let tail = self.tails.at(mid_s);
        let (sigma_m, sigma_rad) = (vicon.sigma_m() * tail, vicon.tip.rotation_sigma_deg.to_radians() * tail);
        let position_m = truth.translation.vector + swapped_m(&self.swaps, mid_s) + shift * sigma_m;
        let reference = Reference::Tracked {
            position_m,
            orientation: Some(truth.rotation * UnitQuaternion::from_scaled_axis(turn * sigma_rad)),
            orientation_sigma_rad: (sigma_rad * shown.sqrt()).max(FLOOR_RAD),
        };
        (reference, Matrix3::identity() * (sigma_m * sigma_m * shown).max(FLOOR_M * FLOOR_M))
    }

    /// What the thermometer says [degC].
    pub fn thermometer(&mut self, celsius: f64) -> f64 {
        celsius + self.draw.normal() * self.config.temperature.noise_k
    }
}
