//! Motors under PID control: the part of the arm that has inertia.

use crate::config::DriveConfig;

/// State of all joints on the motor side, with their controllers.
#[derive(Debug, Clone)]
pub struct Servo {
    drives: Vec<DriveConfig>,
    /// Motor-side angles [rad].
    pub angle_rad: Vec<f64>,
    /// Motor-side speeds [rad/s].
    pub speed_rad_s: Vec<f64>,
    integral_nm: Vec<f64>,
    measured_rad: Vec<f64>,
    measured_rad_s: Vec<f64>,
}

/// Time constant of the controller's speed filter [s]: smooths the steps of the counts.
const SPEED_FILTER_S: f64 = 0.006;

impl Servo {
    /// Joints at rest at `angle_rad`.
    pub fn new(drives: &[DriveConfig], angle_rad: &[f64]) -> Servo {
        let zeros = vec![0.0; drives.len()];
        Servo {
            drives: drives.to_vec(),
            angle_rad: angle_rad.to_vec(),
            speed_rad_s: zeros.clone(),
            integral_nm: zeros.clone(),
            measured_rad: angle_rad.to_vec(),
            measured_rad_s: zeros,
        }
    }

    /// Takes over from the hand at this encoder reading without a jump: the integrator starts with the torque
    /// that holds the arm against `load_nm`.
    pub fn take_over(&mut self, reading_rad: &[f64], load_nm: &[f64]) {
        self.integral_nm = load_nm.iter().map(|t| -t).collect();
        self.measured_rad = reading_rad.to_vec();
        self.measured_rad_s = vec![0.0; self.drives.len()];
        self.speed_rad_s = vec![0.0; self.drives.len()];
    }

    /// The hand moves the joints: motors are off.
    pub fn follow(&mut self, angle_rad: &[f64], step_s: f64) {
        for (j, &angle) in angle_rad.iter().enumerate() {
            self.speed_rad_s[j] = (angle - self.angle_rad[j]) / step_s;
            self.angle_rad[j] = angle;
        }
    }

    /// One step under control (semi-implicit Euler): `reading_rad` is what the encoders say, `load_nm` the
    /// external torque, gravity's.
    pub fn step(&mut self, set_point_rad: &[f64], reading_rad: &[f64], load_nm: &[f64], step_s: f64) {
        let smoothing = step_s / (SPEED_FILTER_S + step_s);
        for (j, drive) in self.drives.iter().enumerate() {
            let speed = (reading_rad[j] - self.measured_rad[j]) / step_s;
            self.measured_rad_s[j] += smoothing * (speed - self.measured_rad_s[j]);
            self.measured_rad[j] = reading_rad[j];
            let error = set_point_rad[j] - reading_rad[j];
            let wanted =
                drive.kp_nm_rad * error + self.integral_nm[j] - drive.kd_nms_rad * self.measured_rad_s[j];
            let torque = wanted.clamp(-drive.max_torque_nm, drive.max_torque_nm);
            // Anti-windup: the integrator stops while the motor saturates.
            if torque == wanted {
                self.integral_nm[j] += drive.ki_nm_rad_s * error * step_s;
            }
            let acceleration =
                (torque + load_nm[j] - drive.viscous_nms_rad * self.speed_rad_s[j]) / drive.inertia_kg_m2;
            self.speed_rad_s[j] += acceleration * step_s;
            self.angle_rad[j] += self.speed_rad_s[j] * step_s;
        }
    }
}

/// An angle as an encoder with `count_rad` a count reads it [rad].
pub fn quantise_angle(angle_rad: f64, count_rad: f64) -> f64 {
    (angle_rad / count_rad).round() * count_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ArmConfig;

    const COUNT_RAD: f64 = std::f64::consts::TAU / 65536.0;

    fn reading(servo: &Servo) -> Vec<f64> {
        servo.angle_rad.iter().map(|q| quantise_angle(*q, COUNT_RAD)).collect()
    }

    fn run(servo: &mut Servo, set_point: &[f64], load: &[f64], steps: usize) {
        for _ in 0..steps {
            let read = reading(servo);
            servo.step(set_point, &read, load, 0.002);
        }
    }

    #[test]
    fn a_step_settles_within_a_count_and_hardly_overshoots() {
        let drives = ArmConfig::default().drives;
        let mut servo = Servo::new(&drives, &[0.0; 3]);
        let load = [0.0, -4.0, 2.0];
        let read = reading(&servo);
        servo.take_over(&read, &load);
        let mut highest = [0.0f64; 3];
        for _ in 0..1000 {
            run(&mut servo, &[0.05; 3], &load, 1);
            (0..3).for_each(|j| highest[j] = highest[j].max(servo.angle_rad[j]));
        }
        for (j, highest) in highest.into_iter().enumerate() {
            assert!((servo.angle_rad[j] - 0.05).abs() < COUNT_RAD, "joint {j}: {}", servo.angle_rad[j]);
            assert!(servo.speed_rad_s[j].abs() < 0.01, "joint {j} still moves at {}", servo.speed_rad_s[j]);
            assert!(highest < 0.05 * 1.25, "joint {j} overshoots to {highest}");
        }
    }

    #[test]
    fn taking_over_a_heavy_arm_does_not_let_it_sag() {
        let drives = ArmConfig::default().drives;
        let mut servo = Servo::new(&drives, &[0.3; 3]);
        let (load, hold) = ([0.0, -8.0, -3.0], reading(&servo));
        let read = reading(&servo);
        servo.take_over(&read, &load);
        for _ in 0..250 {
            run(&mut servo, &hold, &load, 1);
            (0..3).for_each(|j| assert!((servo.angle_rad[j] - 0.3).abs() < 2.0 * COUNT_RAD));
        }
    }

    #[test]
    fn a_load_beyond_the_motor_moves_the_arm_without_winding_up() {
        let drives = ArmConfig::default().drives;
        let mut servo = Servo::new(&drives, &[0.0; 3]);
        run(&mut servo, &[0.0; 3], &[0.0, 0.0, -20.0], 100);
        assert!(servo.angle_rad[2] < -0.05);
        run(&mut servo, &[0.0; 3], &[0.0; 3], 1000);
        assert!(servo.angle_rad[2].abs() < 2.0 * COUNT_RAD, "{}", servo.angle_rad[2]);
    }
}
