//! Where an error enters and what it depends on, in words.

use armcal_diagnose::{DependsOn, EntersAt};

/// Where an error enters, in words.
pub fn channel_told(channel: &EntersAt) -> String {
    match channel {
        EntersAt::Joint(joint) => format!("joint {}", joint + 1),
        EntersAt::Lengths => "all lengths of the arm".to_owned(),
        EntersAt::World => "the tip, along an axis of the world".to_owned(),
        other => other.to_string(),
    }
}

/// What an error depends on, in words before its spelling in formulas.
pub fn driver_told(driver: DependsOn) -> String {
    let words = match driver {
        DependsOn::Angle(j) => format!("the angle of joint {}", j + 1),
        DependsOn::AngleSum(j) => format!("the sum of the angles of joints {} and {}", j + 1, j + 2),
        DependsOn::Direction(j) => format!("the direction in which joint {} arrived", j + 1),
        DependsOn::AngleByDirection(j) => {
            format!("the angle of joint {}, with opposite signs by direction of arrival", j + 1)
        }
        DependsOn::Torque(j) => format!("the gravity torque on joint {}", j + 1),
        DependsOn::SessionTime => "time".to_owned(),
        _ => return driver.to_string(),
    };
    format!("{words} ({driver})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_where_an_error_enters_are_told_in_words() {
        let told = ["joint12", "lengths", "joint2.a", "joint2 with the direction of joint3 kept", "joint"]
            .map(|text| channel_told(&text.to_owned().into()));
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
        let told = ["q2", "tau3", "s1", "t", "s1*q1", "q1+q2", "temperature", "recording"]
            .map(|text| driver_told(text.to_owned().try_into().expect("a driver")));
        assert_eq!(
            told,
            [
                "the angle of joint 2 (q2)",
                "the gravity torque on joint 3 (tau3)",
                "the direction in which joint 1 arrived (s1)",
                "time (t)",
                "the angle of joint 1, with opposite signs by direction of arrival (s1*q1)",
                "the sum of the angles of joints 1 and 2 (q1+q2)",
                "temperature",
                "recording"
            ]
        );
    }
}
