//! Clauses 7.2, 7.3 and 7.6 by hand.

use super::{close, mm, turned};
use crate::distance::{distance_accuracy, distance_repeatability};
use crate::drift::{accuracy_drift, repeatability_drift};
use crate::pose::{accuracy_variation, pose_accuracy, pose_repeatability};
use crate::{IsoError, TipPose, barycentre};
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn pose_accuracy_is_the_barycentre_seen_from_the_command() {
    // Mean of x: (3 + 5 + 1) / 3 = 3, of y: (4 + 2 + 0) / 3 = 2, of z: (8 + 6 + 4) / 3 = 6; sqrt(9 + 4 + 36) = 7.
    let commanded = mm(100.0, 200.0, 300.0);
    let attained = [mm(103.0, 204.0, 308.0), mm(105.0, 202.0, 306.0), mm(101.0, 200.0, 304.0)];
    let ap = pose_accuracy(&commanded, &attained).unwrap();
    close(ap.position_m, 7e-3, 1e-15);
    assert!((ap.axes_m - Vector3::new(3e-3, 2e-3, 6e-3)).norm() < 1e-15);
    assert_eq!(ap.angles_rad, None);
}

#[test]
fn angles_of_accuracy_and_repeatability_are_turns_about_the_axes() {
    // Turns about z of -2, -1, 1, 2 mrad about a mean of 10 mrad from the command: AP_c = 10 mrad,
    // S_c = sqrt((4 + 1 + 1 + 4) / 3) = 1.825742 mrad, RP_c = 3 S_c = 5.477226 mrad.
    let commanded = turned(mm(0.0, 0.0, 0.0), [0.0, 0.0, 0.5]);
    let attained = [-2e-3, -1e-3, 1e-3, 2e-3].map(|d| turned(mm(0.0, 0.0, 0.0), [0.0, 0.0, 0.51 + d]));
    let ap = pose_accuracy(&commanded, &attained).unwrap().angles_rad.unwrap();
    assert!((ap - Vector3::new(0.0, 0.0, 0.01)).norm() < 1e-12, "{ap}");
    let rp = pose_repeatability(&attained).unwrap().angles_rad.unwrap();
    assert!((rp - Vector3::new(0.0, 0.0, 3.0 * (10.0_f64 / 3.0).sqrt() * 1e-3)).norm() < 1e-12, "{rp}");
}

#[test]
fn angles_are_about_the_axes_of_the_world_not_of_the_tip() {
    let commanded = turned(mm(0.0, 0.0, 0.0), [std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.01));
    let attained = TipPose { orientation: commanded.orientation.map(|q| turn * q), ..commanded };
    let ap = pose_accuracy(&commanded, &[attained]).unwrap().angles_rad.unwrap();
    assert!((ap - Vector3::new(0.0, 0.0, 0.01)).norm() < 1e-12, "{ap}");
}

#[test]
fn orientations_on_both_sides_of_half_a_turn_have_a_mean_between_them() {
    let half = std::f64::consts::PI;
    let attained = [half - 0.01, half + 0.03].map(|turn| turned(mm(0.0, 0.0, 0.0), [turn, 0.0, 0.0]));
    let mean = barycentre(&attained);
    let want = turned(mm(0.0, 0.0, 0.0), [half + 0.01, 0.0, 0.0]);
    assert!(mean.turn_from_rad(&want).unwrap().norm() < 1e-12);
}

#[test]
fn repeatability_is_mean_distance_plus_three_deviations() {
    // l = 1, 1, 2, 2 mm: mean 1.5, S_l = sqrt(4 * 0.25 / 3) = 0.577350, RP_l = 1.5 + 1.732051 = 3.232051 mm.
    let attained = [mm(1.0, 0.0, 0.0), mm(-1.0, 0.0, 0.0), mm(0.0, 2.0, 0.0), mm(0.0, -2.0, 0.0)];
    let rp = pose_repeatability(&attained).unwrap();
    close(rp.mean_m, 1.5e-3, 1e-15);
    close(rp.deviation_m, 0.577_350_269e-3, 1e-12);
    close(rp.radius_m, 3.232_050_808e-3, 1e-12);
}

#[test]
fn poses_on_a_sphere_repeat_within_its_radius() {
    // All distances equal r, so S_l = 0 and RP_l = r.
    let corners = [-1.0, 1.0].into_iter().flat_map(|s| [mm(s, 0.0, 0.0), mm(0.0, s, 0.0), mm(0.0, 0.0, s)]);
    let attained: Vec<TipPose> = corners.collect();
    close(pose_repeatability(&attained).unwrap().radius_m, 1e-3, 1e-17);
}

#[test]
fn accuracy_varies_by_the_furthest_two_directions() {
    // Barycentres (0, 0, 0), (3, 4, 0), (0, 0, 1) mm: distances 5, 1, sqrt(9 + 16 + 1) = 5.099020 mm.
    let spread = |centre: TipPose| {
        [-1.0, 1.0]
            .map(|s| TipPose::at(centre.position_m + Vector3::new(s, -s, s) * 1e-4))
            .map(|p| turned(p, [0.0; 3]))
    };
    let mut directions =
        [mm(0.0, 0.0, 0.0), mm(3.0, 4.0, 0.0), mm(0.0, 0.0, 1.0)].map(|c| spread(c).to_vec());
    directions[1].iter_mut().for_each(|p| *p = turned(*p, [2e-3, 0.0, 0.0]));
    directions[2].iter_mut().for_each(|p| *p = turned(*p, [-1e-3, 0.0, 0.0]));
    let variation = accuracy_variation(&directions).unwrap();
    close(variation.position_m, 26.0_f64.sqrt() * 1e-3, 1e-15);
    // About x: 2 and -1 mrad are furthest apart.
    assert!((variation.angles_rad.unwrap() - Vector3::new(3e-3, 0.0, 0.0)).norm() < 1e-12);
}

#[test]
fn distance_is_measured_from_pose_to_pose() {
    // Commanded 100 mm along x; attained 101 and 103 mm: AD = 2, RD = 3 sqrt((1 + 1) / 1) = 4.242641 mm.
    // Along y: commanded 0, attained |0| and |-2|: AD_y = 1, RD_y = 3 sqrt(2) = 4.242641 mm.
    let commanded = [mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0)];
    let far = (103.0_f64 * 103.0 - 4.0).sqrt();
    let attained = [[mm(5.0, 5.0, 5.0), mm(106.0, 5.0, 5.0)], [mm(1.0, 1.0, 1.0), mm(1.0 + far, -1.0, 1.0)]];
    let ad = distance_accuracy(&commanded, &attained).unwrap();
    let rd = distance_repeatability(&attained).unwrap();
    close(ad.position_m, 2e-3, 1e-15);
    close(ad.axes_m.y, 1e-3, 1e-15);
    close(ad.axes_m.z, 0.0, 1e-15);
    close(rd.position_m, 3.0 * 2.0_f64.sqrt() * 1e-3, 1e-15);
    close(rd.axes_m.y, 3.0 * 2.0_f64.sqrt() * 1e-3, 1e-15);
}

#[test]
fn distances_of_orientation_are_turns_between_the_poses() {
    // Commanded 90 deg about x; attained 91 and 93 deg: AD_a = 2 deg, RD_a = 3 sqrt(2) deg.
    let deg = |a: f64| turned(mm(0.0, 0.0, 0.0), [a.to_radians(), 0.0, 0.0]);
    let attained = [[deg(10.0), deg(101.0)], [deg(-5.0), deg(88.0)]];
    let ad = distance_accuracy(&[deg(0.0), deg(90.0)], &attained).unwrap().angles_rad.unwrap();
    let rd = distance_repeatability(&attained).unwrap().angles_rad.unwrap();
    close(ad.x.to_degrees(), 2.0, 1e-12);
    close(rd.x.to_degrees(), 3.0 * 2.0_f64.sqrt(), 1e-12);
    close(ad.y.abs() + ad.z.abs() + rd.y + rd.z, 0.0, 1e-12);
}

#[test]
fn drift_is_the_largest_change_from_the_first_block() {
    // AP of the blocks: 1, 4, 2 mm, so dAP = 3 mm. RP_l: half the distance within a block, 0.5, 0.5, 2 mm, so dRP =
    // 1.5 mm.
    let block = |centre: f64, half: f64| vec![mm(centre, half, 0.0), mm(centre, -half, 0.0)];
    let blocks = [block(1.0, 0.5), block(4.0, 0.5), block(-2.0, 2.0)];
    let commanded = mm(0.0, 0.0, 0.0);
    close(accuracy_drift(&commanded, &blocks).unwrap().position_m, 3e-3, 1e-15);
    close(repeatability_drift(&blocks).unwrap().position_m, 1.5e-3, 1e-15);
    // The standard compares the sizes of the errors: one that only turns its direction has not drifted.
    close(accuracy_drift(&commanded, &[block(1.0, 0.0), block(-1.0, 0.0)]).unwrap().position_m, 0.0, 1e-15);
}

#[test]
fn too_little_or_broken_input_is_refused_in_words() {
    let pose = mm(0.0, 0.0, 0.0);
    let few = pose_repeatability(&[pose]).unwrap_err();
    assert_eq!(few.to_string(), "pose repeatability needs at least 2 cycles, and has 1");
    let nan = pose_accuracy(&pose, &[pose, mm(f64::NAN, 0.0, 0.0)]).unwrap_err();
    assert!(matches!(nan, IsoError::NotFinite { index: 1, .. }), "{nan}");
    assert!(accuracy_variation(&[vec![pose]]).is_err());
    assert!(accuracy_drift(&pose, &[]).is_err());
    assert!(repeatability_drift(&[vec![pose], vec![pose]]).is_err());
}
