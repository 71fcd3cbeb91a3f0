use super::*;
use crate::config::{DeviationConfig, EncoderConfig};
use crate::pair::motion::Motion;

fn config() -> PairConfig {
    let paper = include_str!("../../../../pipelines/lab/two-arms.toml");
    PairConfig::from_toml(paper, Path::new("two-arms.toml")).unwrap()
}

#[test]
fn joined_tips_are_where_each_arm_has_them_by_its_own_angles() {
    for length_mm in [None, Some(150.0)] {
        let mut config = config();
        config.joined = JoinConfig { length_mm, slip_sigma_mm: 0.0, ..JoinConfig::default() };
        let (pair, truth) = (Pair::build(&config), observe(&config).unwrap().truth);
        assert_eq!(pair.link_m, length_mm.unwrap_or(0.0) * 1e-3);
        let joined: Vec<&PairDwellTruth> = truth.recordings[0].dwells.iter().filter(|d| d.joined).collect();
        assert_eq!(joined.len(), config.task.poses);
        for dwell in joined {
            let [a, b] = [0, 1].map(|arm| pair.arms[arm].tip_in_world(&dwell.joint_rad[arm]));
            assert!(((a - b).norm() - pair.link_m).abs() < 1e-8, "{}", (a - b).norm());
        }
        // At home they are apart: the pipeline has to find out.
        let home = &truth.recordings[0].dwells[0];
        let [a, b] = [0, 1].map(|arm| pair.arms[arm].tip_in_world(&home.joint_rad[arm]));
        assert!(!home.joined && (a - b).norm() > 0.1);
    }
}

#[test]
fn on_the_way_the_tips_stay_together_too_and_nothing_jumps() {
    let mut config = config();
    config.joined = JoinConfig { slip_sigma_mm: 0.0, ..JoinConfig::default() };
    config.task.poses = 6;
    let pair = Pair::build(&config);
    let motion = Motion::perform(&config, &pair, 0).unwrap();
    let first_joined = motion.phases.iter().find(|p| p.is_joined_rest()).unwrap().start_s;
    let last_joined = motion.phases.iter().rev().find(|p| p.is_joined_rest()).unwrap().end_s;
    let mut near = motion.phases[0].to_rad.clone();
    let mut time_s = 0.0;
    while time_s < motion.duration_s() {
        let now = [0, 1].map(|arm| motion.joint_rad(&pair, arm, time_s, &near[arm]).unwrap());
        let fastest = now.iter().flatten().zip(near.iter().flatten()).map(|(a, b)| (a - b).abs());
        assert!(fastest.fold(0.0, f64::max) < 0.06, "a leap at {time_s} s");
        if (first_joined..last_joined).contains(&time_s) {
            let [a, b] = [0, 1].map(|arm| pair.arms[arm].tip_in_world(&now[arm]));
            assert!((a - b).norm() < 1e-8, "{} at {time_s} s", (a - b).norm());
        }
        near = now;
        time_s += 0.01;
    }
}

#[test]
fn the_left_arm_is_the_mirror_image_of_the_right() {
    let config = config();
    let [right, left] = [0, 1].map(|arm: usize| AxisArm::from_rows(&config.arms[arm].rows));
    for q in [[0.0, 0.0, 0.0], [0.4, -0.6, 0.2], [-0.9, -0.2, -0.7]] {
        let (mut mirrored, in_left) = (right.tip(&[-q[0], q[1], q[2]]), left.tip(&q));
        mirrored.y = -mirrored.y;
        assert!((mirrored - in_left).norm() < 1e-12, "{mirrored} {in_left}");
    }
}

#[test]
fn two_topics_are_recorded_and_the_same_seed_gives_the_same_bytes() {
    let mut config = config();
    config.task.poses = 4;
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let bytes = folders.each_ref().map(|f| {
        let simulated = simulate(&config, f.path()).unwrap();
        std::fs::read(&simulated.recordings[0]).unwrap()
    });
    assert_eq!(bytes[0], bytes[1]);
    let mut counts = std::collections::BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes[0]).unwrap() {
        *counts.entry(message.unwrap().channel.topic.clone()).or_insert(0) += 1;
    }
    let topics: Vec<&str> = counts.keys().map(String::as_str).collect();
    assert_eq!(topics, ["/left/joint_states", "/right/joint_states"]);
    assert!(counts.values().all(|n| *n > 500), "{counts:?}");
}

#[test]
fn what_cannot_work_is_named() {
    let good = config();
    let says = |change: &dyn Fn(&mut PairConfig)| {
        let mut bad = good.clone();
        change(&mut bad);
        observe(&bad).unwrap_err().to_string()
    };
    assert!(says(&|c| c.arms[1].name = "right".into()).contains("names and topics of their own"));
    assert!(says(&|c| c.arms[0].home_deg = vec![]).contains("arms.home_deg"));
    assert!(
        says(&|c| c.arms[1].deviation = DeviationConfig { length_mm: -1.0, ..Default::default() })
            .contains("length_mm")
    );
    assert!(
        says(&|c| c.arms[1].joints = EncoderConfig { rate_hz: 0.0, ..c.arms[1].joints.clone() })
            .contains("rate_hz")
    );
    assert!(says(&|c| c.recordings = vec!["../x".into()]).contains("name of another file"));
    assert!(says(&|c| c.task.region_m = [[3.0, 3.1]; 3]).contains("meeting point"));
}
