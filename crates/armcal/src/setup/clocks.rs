//! Clocks that cannot be aligned because the joints are read wrongly: the tip's speed is then another one than the arm's.

use armcal_core::JointSamples;

/// With the right reading, the speeds agree like this.
const AGREES: f64 = 0.97;

/// The one change of the joint readings with which the clocks align, in a sentence without its full stop; none where none
/// does. `correlation` aligns them: of the tip's speed with that of the nominal arm, if it can.
pub fn joints_that_align(
    joints: &JointSamples,
    correlation: &dyn Fn(&JointSamples) -> Option<f64>,
) -> Option<String> {
    let n = joints.joint_rad.len();
    let named = |j: usize| format!("joint {} ({})", j + 1, joints.names.get(j).map_or("", String::as_str));
    let mut tried: Vec<(f64, String)> = Vec::new();
    let mut attempt = |changed: JointSamples, words: String| {
        tried.extend(correlation(&changed).filter(|c| *c >= AGREES).map(|c| (c, words)));
    };
    for j in 0..n {
        let mut changed = joints.clone();
        changed.joint_rad[j].iter_mut().for_each(|q| *q = -*q);
        attempt(changed, format!("[joint-sign] with the sign of {} reversed", named(j)));
        for k in j + 1..n {
            let mut changed = joints.clone();
            changed.joint_rad.swap(j, k);
            attempt(changed, format!("[joint-order] with {} and {} exchanged", named(j), named(k)));
        }
    }
    let best = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(format!("{} the clocks align (correlation {:.3})", best.1, best.0))
}
