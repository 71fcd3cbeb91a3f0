//! Mistakes of wiring and of drivers, undone while a recording is read: `factors`, `zeros_deg`, `axes`, `scale`, `invert`.

use super::{JointStream, PoseStream, Streams};
use armcal_core::{JointSamples, Mend, Pose, PoseSamples, in_axes};
use nalgebra::{Matrix3, Translation3};
use serde::{Deserialize, Serialize};

/// One axis of those that are published, with its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// Along x.
    #[serde(rename = "x")]
    X,
    /// Along y.
    #[serde(rename = "y")]
    Y,
    /// Along z.
    #[serde(rename = "z")]
    Z,
    /// Against x.
    #[serde(rename = "-x")]
    MinusX,
    /// Against y.
    #[serde(rename = "-y")]
    MinusY,
    /// Against z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl Axis {
    const ALL: [Axis; 6] = [Axis::X, Axis::Y, Axis::Z, Axis::MinusX, Axis::MinusY, Axis::MinusZ];

    fn row(self) -> [f64; 3] {
        let at = self as usize;
        std::array::from_fn(|k| f64::from(k == at % 3) * if at < 3 { 1.0 } else { -1.0 })
    }

    /// As a pipeline spells it.
    pub fn word(self) -> &'static str {
        ["x", "y", "z", "-x", "-y", "-z"][self as usize]
    }
}

/// What multiplies published positions, from the axes that are to be x, y and z.
fn matrix_of(axes: [Axis; 3]) -> Matrix3<f64> {
    Matrix3::from_row_slice(&axes.map(Axis::row).concat())
}

/// The axes of a signed permutation; none of another matrix.
fn axes_of(matrix: &Matrix3<f64>) -> Option<[Axis; 3]> {
    let axis = |k: usize| Axis::ALL.into_iter().find(|axis| (0..3).all(|c| axis.row()[c] == matrix[(k, c)]));
    Some([axis(0)?, axis(1)?, axis(2)?])
}

impl JointStream {
    /// Refuses lists of another length than `names`.
    pub(crate) fn check_mends(&self) -> Result<(), String> {
        let lists = [("factors", &self.factors), ("zeros_deg", &self.zeros_deg)];
        for (key, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            if list.len() != self.names.len() {
                return Err(format!("`{key}` has {} numbers for {} `names`", list.len(), self.names.len()));
            }
            if list.iter().any(|x| !x.is_finite()) || key == "factors" && list.contains(&0.0) {
                return Err(format!("`{key}` must have finite numbers, and no factor of 0"));
            }
        }
        Ok(())
    }

    /// Readings in radians, and efforts, as they would be without the mistakes.
    pub(crate) fn mend_readings(&self, samples: &mut JointSamples) {
        for (j, column) in samples.joint_rad.iter_mut().enumerate() {
            let factor = self.factors.get(j).copied().unwrap_or(1.0);
            let zero_rad = self.zeros_deg.get(j).map_or(0.0, |deg| deg.to_radians());
            if factor != 1.0 || zero_rad != 0.0 {
                column.iter_mut().for_each(|q| *q = factor * *q + zero_rad);
            }
            if let Some(effort) = samples.effort_nm.as_mut().filter(|_| factor < 0.0) {
                effort[j].iter_mut().for_each(|nm| *nm = -*nm);
            }
        }
    }

    fn mend(&mut self, factors: &[f64], zeros_rad: &[f64]) {
        let now = |list: &[f64], j: usize, nothing: f64| list.get(j).copied().unwrap_or(nothing);
        let (old, moved) = (std::mem::take(&mut self.factors), std::mem::take(&mut self.zeros_deg));
        let factor = |(j, by): (usize, &f64)| (by * now(&old, j, 1.0) * 1e6).round() / 1e6;
        self.factors = factors.iter().enumerate().map(factor).collect();
        let zero =
            |(j, (by, rad)): (usize, (&f64, &f64))| written_deg(by * now(&moved, j, 0.0) + rad.to_degrees());
        self.zeros_deg = factors.iter().zip(zeros_rad).enumerate().map(zero).collect();
        self.drop_mends_of_nothing();
    }

    fn drop_mends_of_nothing(&mut self) {
        if self.factors.iter().all(|by| *by == 1.0) {
            self.factors.clear();
        }
        if self.zeros_deg.iter().all(|deg| *deg == 0.0) {
            self.zeros_deg.clear();
        }
    }

    fn reorder(&mut self, order: &[usize]) {
        let by = |list: &mut Vec<f64>| {
            if !list.is_empty() {
                *list = order.iter().map(|from| list[*from]).collect();
            }
        };
        self.names = order.iter().map(|from| self.names[*from].clone()).collect();
        by(&mut self.factors);
        by(&mut self.zeros_deg);
        if !self.encoders.is_empty() {
            self.encoders = order.iter().map(|from| self.encoders[*from]).collect();
        }
    }
}

/// The angle by the shorter way round, to what anybody writes down [deg].
fn written_deg(degrees: f64) -> f64 {
    let shorter = degrees - 360.0 * (degrees / 360.0).round_ties_even();
    (shorter * 1e3).round() / 1e3
}

impl PoseStream {
    /// Refuses axes of which one is named twice.
    pub(crate) fn check_mends(&self) -> Result<(), String> {
        for (key, axes) in [("axes", self.axes), ("orientation_axes", self.orientation_axes)] {
            if axes.is_some_and(|axes| matrix_of(axes).determinant() == 0.0) {
                return Err(format!(
                    "`{key}` must name each of x, y and z once, such as [\"x\", \"-z\", \"y\"]"
                ));
            }
        }
        let numbers = [("clock_rate", self.clock_rate), ("scale", self.scale)];
        let wrong = |of: &&(&str, Option<f64>)| of.1.is_some_and(|x| !(x.is_finite() && x > 0.0));
        match numbers.iter().find(wrong) {
            Some((key, _)) => Err(format!("`{key}` must be a positive number")),
            None => Ok(()),
        }
    }

    /// Poses as they would be without the mistakes.
    pub(crate) fn mend_poses(&self, samples: &mut PoseSamples) -> Result<(), String> {
        if let Some(rate) = self.clock_rate {
            samples.slow_down(rate);
        }
        if let Some(scale) = self.scale {
            samples.position_m.iter_mut().for_each(|p| *p *= scale);
        }
        if let Some(axes) = self.axes.map(matrix_of) {
            samples.position_m.iter_mut().for_each(|p| *p = axes * *p);
        }
        if let Some((axes, turned)) = self.orientation_axes.map(matrix_of).zip(samples.orientation.as_mut()) {
            turned.iter_mut().for_each(|q| *q = in_axes(&axes, q));
        }
        if !self.invert {
            return Ok(());
        }
        let turned =
            samples.orientation.as_mut().ok_or("`invert` needs the orientation beside each position")?;
        for (position, q) in samples.position_m.iter_mut().zip(turned) {
            let inverse = Pose::from_parts(Translation3::from(*position), *q).inverse();
            (*position, *q) = (inverse.translation.vector, inverse.rotation);
        }
        Ok(())
    }
}

impl Streams {
    /// Undoes a mistake; `false`, and nothing changed, where no key does.
    pub fn mend(&mut self, mend: &Mend) -> bool {
        match mend {
            Mend::Readings { factors, zeros_rad } => {
                let Some(joints) = self.only_joints(factors.len()) else { return false };
                joints.mend(factors, zeros_rad);
            }
            Mend::Order(order) => {
                let Some(joints) = self.only_joints(order.len()) else { return false };
                joints.reorder(order);
            }
            Mend::Axes(matrix) | Mend::AxesOfArm(matrix) => {
                let Some(axes) = axes_of(matrix) else { return false };
                let mut bodies = self.bodies_of(mend);
                if bodies.iter().any(|s| s.axes.is_some() || s.invert) {
                    return false;
                }
                bodies.iter_mut().for_each(|s| s.axes = Some(axes));
            }
            Mend::Scale(by) => {
                let now = |s: &PoseStream| Some((by * s.scale.unwrap_or(1.0) * 1e4).round() / 1e4);
                self.bodies_of(mend).into_iter().for_each(|s| s.scale = now(s));
            }
            Mend::OrientationAxes(matrix) => {
                let Some(axes) = axes_of(matrix) else { return false };
                let mut bodies = self.bodies_of(mend);
                if bodies.iter().any(|s| s.orientation_axes.is_some() || s.invert) {
                    return false;
                }
                bodies.iter_mut().for_each(|s| s.orientation_axes = Some(axes));
            }
            Mend::Inverted | Mend::TipInverted => {
                self.bodies_of(mend).into_iter().for_each(|s| s.invert = !s.invert);
            }
        }
        true
    }

    /// The keys that undo a mistake, for people: `` `invert = true` under [streams.tip] ``.
    pub fn mending_keys(&self, mend: &Mend) -> Option<String> {
        let mut mended = self.clone();
        mended.mend(mend).then_some(())?;
        let (key, of) = match mend {
            Mend::Readings { .. } => {
                let joints = &mended.joints[0];
                let lists = [("factors", &joints.factors), ("zeros_deg", &joints.zeros_deg)];
                let lists = lists.into_iter().filter(|(_, list)| !list.is_empty());
                (
                    lists.map(|(key, list)| format!("`{key} = {list:?}`")).collect::<Vec<_>>().join(" and "),
                    "[streams.joints]",
                )
            }
            Mend::Order(_) => (format!("`names = {:?}`", mended.joints[0].names), "[streams.joints]"),
            Mend::Axes(matrix) | Mend::AxesOfArm(matrix) => {
                let words = axes_of(matrix)?.map(Axis::word);
                (format!("`axes = {words:?}`"), mended.sections_of(mend))
            }
            Mend::Scale(_) => {
                let scale = mended.bodies_of(mend).first().and_then(|s| s.scale)?;
                (format!("`scale = {scale}`"), mended.sections_of(mend))
            }
            Mend::OrientationAxes(matrix) => {
                let words = axes_of(matrix)?.map(Axis::word);
                (format!("`orientation_axes = {words:?}`"), mended.sections_of(mend))
            }
            Mend::Inverted | Mend::TipInverted => ("`invert = true`".to_owned(), mended.sections_of(mend)),
        };
        Some(format!("{key} under {of}"))
    }

    fn only_joints(&mut self, joints: usize) -> Option<&mut JointStream> {
        match &mut self.joints[..] {
            [only] if only.names.len() == joints => Some(only),
            _ => None,
        }
    }

    fn bodies_of(&mut self, mend: &Mend) -> Vec<&mut PoseStream> {
        let standing = matches!(mend, Mend::Axes(_) | Mend::Inverted | Mend::Scale(_));
        let markers = !matches!(mend, Mend::TipInverted);
        let still = [&mut self.base, &mut self.table].into_iter().flatten().filter(|_| standing);
        let moving = self.bodies.values_mut().filter(|_| markers);
        self.tip.iter_mut().chain(moving).chain(still).collect()
    }

    fn sections_of(&mut self, mend: &Mend) -> &'static str {
        match self.bodies_of(mend).len() {
            1 if self.tip.is_some() => "[streams.tip]",
            _ => "each body of [streams]",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    fn joints(names: &[&str]) -> JointStream {
        JointStream { names: names.iter().map(ToString::to_string).collect(), ..JointStream::default() }
    }

    #[test]
    fn mistakes_one_upon_the_other_are_undone_in_turn() {
        let mut streams = Streams { joints: vec![joints(&["a", "b"])], ..Streams::default() };
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(streams.mend(&Mend::of_reading(0, 2, 1.0, quarter)));
        assert!(streams.mend(&Mend::of_reading(0, 2, -1.0, 0.0)));
        assert!(streams.mend(&Mend::Order(vec![1, 0])));
        let own = &streams.joints[0];
        assert_eq!(
            (&own.names[..], &own.factors[..], &own.zeros_deg[..]),
            (&["b".to_owned(), "a".to_owned()][..], &[1.0, -1.0][..], &[0.0, -90.0][..])
        );
        let mut read = JointSamples { joint_rad: vec![vec![0.5], vec![0.25]], ..JointSamples::default() };
        own.mend_readings(&mut read);
        assert_eq!(read.joint_rad, [vec![0.5], vec![-0.25 - quarter]]);
        assert!(!streams.mend(&Mend::Order(vec![2, 1, 0])), "three joints of two");
        assert_eq!(
            streams.mending_keys(&Mend::of_reading(1, 2, -1.0, quarter)).unwrap_or_default(),
            "`zeros_deg = [0.0, 180.0]` under [streams.joints]"
        );
    }

    #[test]
    fn axes_and_inverted_poses_come_back() {
        let stream: PoseStream =
            toml::from_str("topic = \"/t\"\naxes = [\"x\", \"-z\", \"y\"]").expect("axes");
        let mut read =
            PoseSamples { position_m: vec![Vector3::new(1.0, 2.0, 3.0)], ..PoseSamples::default() };
        stream.mend_poses(&mut read).expect("positions");
        assert_eq!(read.position_m[0], Vector3::new(1.0, -3.0, 2.0));
        let pose = Pose::new(Vector3::new(0.3, -1.0, 2.0), Vector3::new(0.1, 0.7, -0.4));
        let mut read = PoseSamples {
            position_m: vec![pose.inverse().translation.vector],
            orientation: Some(vec![pose.inverse().rotation]),
            ..PoseSamples::default()
        };
        let stream = PoseStream { invert: true, ..PoseStream::default() };
        stream.mend_poses(&mut read).expect("poses");
        assert!((read.position_m[0] - pose.translation.vector).norm() < 1e-12);
        let mut bare = PoseSamples { position_m: vec![Vector3::zeros()], ..PoseSamples::default() };
        assert!(stream.mend_poses(&mut bare).is_err());
        let twice: PoseStream = toml::from_str("topic = \"/t\"\naxes = [\"x\", \"x\", \"y\"]").expect("axes");
        assert!(twice.check_mends().is_err());
        // An attitude in y-up axes beside positions in z-up ones.
        let up =
            PoseStream { orientation_axes: Some([Axis::X, Axis::MinusZ, Axis::Y]), ..PoseStream::default() };
        let mut read = PoseSamples {
            position_m: vec![Vector3::zeros()],
            orientation: Some(vec![UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.3)]),
            ..PoseSamples::default()
        };
        up.mend_poses(&mut read).expect("poses");
        let about_z = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
        assert!(read.orientation.expect("still there")[0].angle_to(&about_z) < 1e-9);
    }
}
