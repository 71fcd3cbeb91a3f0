//! Poses that are alike, found through cells, against asking every one before.

use super::AlikePoses;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn each_pose_is_with_the_first_one_before_it_that_is_alike() {
    const REACH_RAD: f64 = 0.05;
    for joints in [1, 2, 3, 6] {
        let mut rng = ChaCha8Rng::seed_from_u64(joints as u64);
        // Narrow enough that many are alike, on both sides of zero.
        let span =
            REACH_RAD * [40.0, 8.0, 4.0, 2.0][[1, 2, 3, 6].iter().position(|n| *n == joints).unwrap_or(0)];
        let poses: Vec<Vec<f64>> =
            (0..600).map(|_| (0..joints).map(|_| rng.random_range(-span..span)).collect()).collect();
        let mut first: Vec<&[f64]> = Vec::new();
        let mut alike = AlikePoses::within(REACH_RAD);
        for pose in &poses {
            let is_alike = |other: &&[f64]| other.iter().zip(pose).all(|(a, b)| (a - b).abs() < REACH_RAD);
            let expected = first.iter().position(is_alike).unwrap_or_else(|| {
                first.push(pose);
                first.len() - 1
            });
            assert_eq!(alike.group_of(pose), expected, "{joints} joints: {pose:?}");
        }
        assert!(first.len() > 10 && first.len() < 550, "{joints} joints: {} groups", first.len());
    }
    let mut alike = AlikePoses::within(REACH_RAD);
    assert_eq!([[].as_slice(), &[0.0], &[f64::NAN], &[0.01]].map(|pose| alike.group_of(pose)), [0, 1, 2, 1]);
}
