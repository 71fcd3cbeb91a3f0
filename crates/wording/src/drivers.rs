//! Where an error enters and what it depends on, in words.

/// Where an error enters, in words.
pub fn channel_told(channel: &str) -> String {
    let joint = channel.strip_prefix("joint").filter(|n| n.chars().all(|c| c.is_ascii_digit()));
    match (channel, joint) {
        (_, Some(number)) if !number.is_empty() => format!("joint {number}"),
        ("lengths", _) => "all lengths of the arm".to_owned(),
        ("world", _) => "the tip, along an axis of the world".to_owned(),
        _ => channel.to_owned(),
    }
}

/// What an error depends on, in words before its spelling in formulas; other products and sums of drivers as they are spelt.
pub fn driver_told(driver: &str) -> String {
    let joint = |text: &str, kind: char| text.strip_prefix(kind)?.parse::<usize>().ok();
    let product = driver.split_once('*').and_then(|(s, q)| Some((joint(s, 's')?, joint(q, 'q')?)));
    let sum = driver.split_once('+').and_then(|(a, b)| Some((joint(a, 'q')?, joint(b, 'q')?)));
    match (product, sum) {
        (Some((s, q)), _) if s == q => {
            return format!("the angle of joint {q}, with opposite signs by direction of arrival ({driver})");
        }
        (_, Some((a, b))) => return format!("the sum of the angles of joints {a} and {b} ({driver})"),
        _ => {}
    }
    let (kind, joint) = driver.split_at(driver.find(|c: char| c.is_ascii_digit()).unwrap_or(driver.len()));
    let words = match (kind, joint.parse::<usize>()) {
        ("q", Ok(joint)) => format!("the angle of joint {joint}"),
        ("tau", Ok(joint)) => format!("the gravity torque on joint {joint}"),
        ("s", Ok(joint)) => format!("the direction in which joint {joint} arrived"),
        ("t", _) if joint.is_empty() => "time".to_owned(),
        _ => return driver.to_owned(),
    };
    format!("{words} ({driver})")
}

#[cfg(test)]
mod tests {
    use super::{channel_told, driver_told};

    #[test]
    fn places_where_an_error_enters_are_told_in_words() {
        let told = ["joint12", "lengths", "joint2.a", "joint2 with the direction of joint3 kept", "joint"]
            .map(channel_told);
        let words = [
            "joint 12",
            "all lengths of the arm",
            "joint2.a",
            "joint2 with the direction of joint3 kept",
            "joint",
        ];
        assert_eq!(told, words);
    }

    #[test]
    fn drivers_are_told_in_words_before_their_spelling() {
        let told =
            ["q2", "tau3", "s1", "t", "s1*q1", "q1+q2", "s1*q2", "temperature", "recording"].map(driver_told);
        assert_eq!(
            told,
            [
                "the angle of joint 2 (q2)",
                "the gravity torque on joint 3 (tau3)",
                "the direction in which joint 1 arrived (s1)",
                "time (t)",
                "the angle of joint 1, with opposite signs by direction of arrival (s1*q1)",
                "the sum of the angles of joints 1 and 2 (q1+q2)",
                "s1*q2",
                "temperature",
                "recording"
            ]
        );
    }
}
