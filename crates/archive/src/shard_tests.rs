use super::*;

fn completion_marker(number: usize, of: usize, recordings: usize) -> CompletionMarker {
    let shard = Shard { number, of };
    let done = (0..recordings).filter(|i| shard.has(*i));
    let done = done.map(|index| Done::Calibrated { index, folder: format!("r{index}") }).collect();
    CompletionMarker::new(shard, "key".into(), "p", recordings, done, 0)
}

fn merge_error(completion_markers: Vec<CompletionMarker>) -> String {
    merge_shards(completion_markers, Path::new("D")).expect_err("no whole").to_string()
}

#[test]
fn any_number_of_shares_is_the_same_in_the_end() {
    for of in [1, 3, 17] {
        // Completion markers are read in the order of their file names, which is not that of the shares.
        let mut completion_markers: Vec<CompletionMarker> =
            (1..=of).map(|number| completion_marker(number, of, 10)).collect();
        completion_markers.reverse();
        let (_, done) = merge_shards(completion_markers, Path::new("D")).expect("a whole");
        assert_eq!(done.iter().map(Done::index).collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
    }
}

#[test]
fn what_is_missing_or_doubled_is_named() {
    let missing = merge_error(vec![completion_marker(1, 4, 9), completion_marker(3, 4, 9)]);
    assert!(missing.contains("2/4, 4/4 is missing"), "{missing}");
    let twice =
        merge_error(vec![completion_marker(1, 2, 9), completion_marker(2, 2, 9), completion_marker(2, 2, 9)]);
    assert!(twice.contains("2/2 is there twice"), "{twice}");
    let mixed = merge_error(vec![completion_marker(1, 2, 9), completion_marker(2, 3, 9)]);
    assert!(mixed.contains("1/2 and 2/3"), "{mixed}");
    let other = CompletionMarker { campaign: "another".into(), ..completion_marker(2, 2, 9) };
    assert!(
        merge_error(vec![completion_marker(1, 2, 9), other]).contains("1/2 and 2/2 are not of one manifest")
    );
    let mut short = completion_marker(2, 2, 9);
    short.done.pop();
    assert!(merge_error(vec![completion_marker(1, 2, 9), short]).contains("recording 8 of the manifest"));
    assert!(merge_error(Vec::new()).contains("no share"));
}

#[test]
fn shares_are_written_from_one() {
    assert_eq!("2/17".parse(), Ok(Shard { number: 2, of: 17 }));
    for wrong in ["0/3", "4/3", "1", "a/b", "-1/3", "1/0"] {
        assert!(wrong.parse::<Shard>().expect_err(wrong).contains("1/3, 2/3 or 3/3"));
    }
}
