//! Planted recordings: is every dwell right, or reported as unsure?

pub(super) mod planted;

use super::*;
use crate::{Assignment, Place};
use armcal_core::Code;
use planted::{Plan, Planted, Truth, mukca, paper, rng, tip};
use proptest::prelude::*;
use rand::seq::SliceRandom as _;

/// How associations compare with the truth.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
struct Count {
    seated_right: usize,
    seated_unsure: usize,
    other_right: usize,
    other_unsure: usize,
    wrong: usize,
    refused: usize,
}

fn compare(planted: &Planted, outcome: &Result<Association, TableError>, count: &mut Count) {
    let Ok(found) = outcome else {
        count.refused += 1;
        return;
    };
    for (assignment, truth) in found.assignments.iter().zip(&planted.truth) {
        *match (&assignment.place, truth) {
            (Place::Seated { cavity, .. }, Truth::Seated(t)) if cavity == t => &mut count.seated_right,
            (Place::Hovering { above, .. }, Truth::Hovering(t)) if above == t => &mut count.other_right,
            (Place::FreeSpace, Truth::Free) => &mut count.other_right,
            (Place::Ambiguous { .. } | Place::Unassigned { .. }, Truth::Seated(_)) => {
                &mut count.seated_unsure
            }
            (Place::Ambiguous { .. } | Place::Unassigned { .. }, _) => &mut count.other_unsure,
            _ => &mut count.wrong,
        } += 1;
    }
}

/// Random plans, alternately with a mean error of 30 mm and with DH errors of 5 mm and 2 deg as they come.
fn many(seeds: std::ops::Range<u64>, unknown: bool) -> Count {
    let mut count = Count::default();
    for seed in seeds {
        let mut rng = rng(seed);
        let mean_error_m = (seed % 2 == 0).then_some(0.030);
        let plan = Plan::random(&mut rng, &paper(), mean_error_m);
        let planted = Planted::new(&mut rng, paper(), &plan);
        let start = if unknown { BoardStart::Unknown } else { planted.known() };
        compare(&planted, &run(&planted, &start), &mut count);
    }
    show(&count);
    count
}

/// Seen with `cargo test -- --nocapture`.
#[allow(clippy::print_stdout)]
fn show(count: &Count) {
    println!("{count:?}");
}

fn run(planted: &Planted, start: &BoardStart) -> Result<Association, TableError> {
    associate(&planted.board, &planted.tips, start, &AssociationConfig::default())
}

fn plan(visits: Vec<usize>) -> Plan {
    Plan {
        mean_error_m: Some(0.030),
        visits,
        hovering: 0.0,
        free: 0,
        scatter_m: 0.0005,
        tilt: Default::default(),
    }
}

fn line() -> Vec<usize> {
    let board = paper();
    (0..33).filter(|&k| board.cavities[k].name.starts_with("line")).collect()
}

#[test]
fn a_board_of_given_pose_is_never_read_wrong() {
    let count = many(0..200, false);
    assert_eq!((count.wrong, count.refused), (0, 0), "{count:?}");
    assert!(count.seated_unsure * 500 < count.seated_right, "{count:?}");
}

#[test]
fn a_board_of_unknown_pose_is_never_read_wrong() {
    let count = many(1000..1080, true);
    assert_eq!((count.wrong, count.refused), (0, 0), "{count:?}");
    assert!(count.seated_unsure * 500 < count.seated_right, "{count:?}");
}

#[test]
fn the_middle_of_a_line_alone_is_ambiguous_and_says_so() {
    let mut rng = rng(1);
    let planted = Planted::new(&mut rng, paper(), &plan(line()[3..10].to_vec()));
    let found = run(&planted, &planted.known()).unwrap();
    for (assignment, truth) in found.assignments.iter().zip(&planted.truth) {
        let (Place::Ambiguous { cavities }, Truth::Seated(t)) = (&assignment.place, truth) else {
            panic!("{assignment:?}")
        };
        assert!(cavities.len() >= 2 && cavities.contains(t), "{cavities:?} without {t}");
    }
    let codes: Vec<_> = found.warnings.iter().map(|w| w.code.as_str()).collect();
    assert_eq!(codes, ["association-ambiguous", "too-few-seated"]);
}

#[test]
fn a_line_with_both_ends_is_certain() {
    let mut count = Count::default();
    for seed in 0..10 {
        let planted = Planted::new(&mut rng(seed), paper(), &plan(line()));
        compare(&planted, &run(&planted, &planted.known()), &mut count);
    }
    assert_eq!(count, Count { seated_right: 130, ..Count::default() });
}

#[test]
fn one_place_on_a_circle_of_unknown_pose_is_ambiguous() {
    let planted = Planted::new(&mut rng(2), paper(), &plan((0..20).collect()));
    let found = run(&planted, &BoardStart::Unknown).unwrap();
    let ambiguous =
        |a: &Assignment| matches!(&a.place, Place::Ambiguous { cavities } if cavities.len() >= 10);
    assert!(found.assignments.iter().all(ambiguous), "{:?}", found.assignments[0]);
}

/// Two sockets visited thirty times each by an arm whose nominal model scatters within a socket.
fn two_sockets(seed: u64, scatter_m: f64) -> (Vec<DwellTip>, Vec<String>) {
    let mut rng = rng(seed);
    let pose = Pose::new(
        Vector3::from_fn(|_, _| rng.random_range(-0.5..0.5)),
        Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0)),
    );
    let mut tips = Vec::new();
    for i in 0..60 {
        let at = pose.transform_point(&mukca().cavities[i / 30].in_board_m.into()).coords;
        let mut normal = || (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>();
        tips.push(tip(i, at + Vector3::from_fn(|_, _| scatter_m * normal())));
    }
    (tips, (0..60).map(|i| format!("hole_{}", i / 30)).collect())
}

#[test]
fn two_sockets_need_an_order() {
    let order = Some(vec!["hole_0".to_owned(), "hole_1".to_owned()]);
    let config = AssociationConfig { visiting_order: order, ..AssociationConfig::default() };
    for seed in 0..20 {
        let (tips, truth) = two_sockets(seed, 0.0055);
        let found = associate(&mukca(), &tips, &BoardStart::Unknown, &config).unwrap();
        for (assignment, t) in found.assignments.iter().zip(&truth) {
            let right = matches!(&assignment.place, Place::Seated { cavity, .. } if cavity == t);
            let unsure = matches!(assignment.place, Place::Unassigned { .. });
            assert!(
                right || (unsure && assignment.distance_m > 0.015),
                "seed {seed}: {assignment:?}, truly {t}"
            );
        }
        let found = associate(&mukca(), &tips, &BoardStart::Unknown, &AssociationConfig::default()).unwrap();
        let seated = |a: &Assignment| matches!(a.place, Place::Seated { .. });
        assert!(!found.assignments.iter().any(seated), "seed {seed}: the flip was guessed");
    }
}

#[test]
fn a_marker_beside_the_tip_and_dwells_the_sensor_missed_do_no_harm() {
    let mut count = Count::default();
    for seed in 0..10 {
        let mut rng = rng(seed);
        let random = Plan::random(&mut rng, &paper(), Some(0.03));
        let mut planted = Planted::new(&mut rng, paper(), &random);
        for (i, t) in planted.tips.iter_mut().enumerate().filter(|(i, _)| i % 7 != 3) {
            t.measured_m = Some(planted.true_m[i] + Vector3::new(0.018, -0.012, 0.070));
        }
        compare(&planted, &run(&planted, &planted.known()), &mut count);
    }
    show(&count);
    assert_eq!((count.wrong, count.refused), (0, 0), "{count:?}");
    assert!(count.seated_unsure * 200 < count.seated_right, "{count:?}");
}

#[test]
fn dwells_that_are_all_at_one_height_are_seated() {
    let mut planted = Planted::new(&mut rng(4), paper(), &plan((0..33).collect()));
    planted.tips.iter_mut().for_each(|t| t.predicted_m.z += 0.020);
    let mut count = Count::default();
    compare(&planted, &run(&planted, &planted.known()), &mut count);
    assert_eq!(count, Count { seated_right: 33, ..Count::default() });
}

#[test]
fn the_order_of_cavities_in_the_file_does_not_matter() {
    let mut rng = rng(5);
    let random = Plan::random(&mut rng, &paper(), Some(0.03));
    let mut planted = Planted::new(&mut rng, paper(), &random);
    for start in [planted.known(), BoardStart::Unknown] {
        let before = run(&planted, &start).unwrap();
        planted.board.cavities.shuffle(&mut rng);
        assert_eq!(format!("{before:?}"), format!("{:?}", run(&planted, &start).unwrap()));
    }
}

#[test]
fn dwells_may_come_in_any_order() {
    let mut rng = rng(6);
    let random = Plan::random(&mut rng, &paper(), Some(0.03));
    let mut planted = Planted::new(&mut rng, paper(), &random);
    let mut before = run(&planted, &planted.known()).unwrap().assignments;
    planted.tips.reverse();
    before.reverse();
    assert_eq!(format!("{before:?}"), format!("{:?}", run(&planted, &planted.known()).unwrap().assignments));
}

#[test]
fn a_board_that_does_not_fit_is_refused() {
    let mut rng = rng(7);
    let mut planted = Planted::new(&mut rng, paper(), &plan((0..33).collect()));
    let known = planted.known();
    // Another board: the same cavities half as far apart again.
    planted.board.cavities.iter_mut().for_each(|c| c.in_board_m *= 1.5);
    for start in [&known, &BoardStart::Unknown] {
        let error = run(&planted, start).unwrap_err();
        assert!(matches!(error, TableError::DoesNotFit { .. }) && error.to_string().contains("does not fit"));
    }
    // Tips anywhere over the board.
    let mut scattered = |_, _| rng.random_range(-0.1..0.1);
    let mut planted = Planted::new(&mut planted::rng(8), paper(), &plan((0..33).collect()));
    for t in &mut planted.tips {
        t.predicted_m = Vector3::new(0.42, 0.0, 0.1) + Vector3::from_fn(&mut scattered);
    }
    assert!(matches!(run(&planted, &planted.known()), Err(TableError::DoesNotFit { .. })));
    assert!(matches!(run(&planted, &BoardStart::Unknown), Err(TableError::DoesNotFit { .. })));
}

#[test]
fn a_pose_turned_too_far_is_said() {
    let mut planted = Planted::new(&mut rng(9), paper(), &plan((0..33).collect()));
    planted.world_from_board *= nalgebra::UnitQuaternion::from_euler_angles(0.2, 0.0, 0.0);
    let found = run(&planted, &planted.known()).unwrap();
    assert!(found.warnings.iter().any(|w| w.code == Code::BoardTurned), "{:?}", found.warnings);
}

#[test]
fn numbers_that_are_none_and_recordings_that_are_empty_are_no_panic() {
    let mut planted = Planted::new(&mut rng(10), paper(), &plan((0..33).collect()));
    planted.tips[4].predicted_m.x = f64::NAN;
    let found = run(&planted, &planted.known()).unwrap();
    assert!(matches!(&found.assignments[4].place, Place::Unassigned { why } if why.contains("finite")));
    planted.tips.clear();
    assert!(run(&planted, &BoardStart::Unknown).unwrap().assignments.is_empty());
    planted.tips.push(tip(0, Vector3::new(f64::INFINITY, 0.0, 0.0)));
    assert!(run(&planted, &BoardStart::Unknown).is_err());
    let order = Some(vec!["circel01".to_owned()]);
    let config = AssociationConfig { visiting_order: order, ..AssociationConfig::default() };
    let error = associate(&paper(), &planted.tips, &BoardStart::Unknown, &config).unwrap_err().to_string();
    assert!(error.contains("did you mean `circle01`?"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn an_alignment_has_the_support_of_all_places_or_less_than_was_asked(
        seed in 0_u64..1000, shift in prop::array::uniform3(-0.02..0.02), turn in prop::array::uniform3(-0.1..0.1),
        least in 0.0..60.0
    ) {
        let mut rng = rng(seed);
        let random = Plan::random(&mut rng, &paper(), Some(0.005));
        let planted = Planted::new(&mut rng, paper(), &random);
        let config = AssociationConfig::default();
        let problem = Problem::new(&planted.board, &planted.tips, &BoardStart::Unknown, &config);
        let board_from_world = Pose::new(Vector3::from(shift), Vector3::from(turn)) * planted.world_from_board.inverse();
        // A place counts one less the square of its distance from the nearest cavity, in two fifths of their spacing.
        let counts = |site: &problem::Site| {
            let apart_m = problem.layout.nearest(&(board_from_world * nalgebra::Point3::from(site.at_m)).coords).1;
            site.weight * (1.0 - (apart_m / (0.4 * problem.layout.spacing_m)).powi(2)).max(0.0)
        };
        let of_all: f64 = problem.sites.iter().map(counts).sum();
        match search::support_of_all(&problem, &board_from_world, least) {
            Some(support) => prop_assert!((support - of_all).abs() < 1e-9, "{} {}", support, of_all),
            None => prop_assert!(of_all < least, "{of_all} {least}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn where_the_world_has_its_origin_does_not_matter(
        seed in 0_u64..1000, shift in prop::array::uniform3(-2.0..2.0), turn in prop::array::uniform3(-2.0..2.0)
    ) {
        let mut rng = rng(seed);
        let random = Plan::random(&mut rng, &paper(), Some(0.03));
        let mut planted = Planted::new(&mut rng, paper(), &random);
        let before = run(&planted, &planted.known()).unwrap();
        let moved = Pose::new(Vector3::from(shift), Vector3::from(turn));
        planted.world_from_board = moved * planted.world_from_board;
        for t in &mut planted.tips {
            t.predicted_m = moved.transform_point(&t.predicted_m.into()).coords;
        }
        let after = run(&planted, &planted.known()).unwrap();
        for (a, b) in before.assignments.iter().zip(&after.assignments) {
            let same = match (&a.place, &b.place) {
                (Place::Seated { cavity: a, .. }, Place::Seated { cavity: b, .. }) => a == b,
                (Place::Hovering { above: a, .. }, Place::Hovering { above: b, .. }) => a == b,
                (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
            };
            prop_assert!(same, "{a:?} {b:?}");
        }
        let back = moved.inverse() * after.board_in_world;
        prop_assert!((back.to_homogeneous() - before.board_in_world.to_homogeneous()).norm() < 1e-5);
    }
}
