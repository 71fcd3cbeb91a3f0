//! Which readings of a thermometer can be temperatures of a laboratory, and in which unit.
//!
//! Messages of a temperature are in degrees Celsius by definition (sensor_msgs/Temperature). What is written where there
//! is none (-999, 0x7fff, 1e38) is no reading. A stream that never reads what a laboratory can have in degrees Celsius,
//! but what it has in kelvin, is in kelvin.

/// What a laboratory, and a robot in it, can have [degC].
const POSSIBLE_C: std::ops::RangeInclusive<f64> = -60.0..=150.0;
/// The same in kelvin where it cannot be mistaken for degrees Celsius.
const KELVIN: std::ops::RangeInclusive<f64> = 200.0..=400.0;
const ZERO_C_K: f64 = 273.15;

/// What a room has in degrees Fahrenheit, and few rooms or motors have in degrees Celsius.
const ROOM_F: std::ops::RangeInclusive<f64> = 59.0..=104.0;

/// How the readings of a stream are to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// As they are.
    Celsius,
    /// All of them in kelvin.
    Kelvin,
    /// Some of either: which are right cannot be told.
    Mixed,
}

impl Scale {
    pub(crate) fn of(values: &[f64]) -> Scale {
        let celsius = values.iter().filter(|v| POSSIBLE_C.contains(*v)).count();
        let kelvin = values.iter().filter(|v| KELVIN.contains(*v)).count();
        match (celsius, kelvin) {
            (0, 1..) if 2 * kelvin >= values.len() => Scale::Kelvin,
            (celsius, kelvin) if kelvin > celsius => Scale::Mixed,
            _ => Scale::Celsius,
        }
    }

    /// The temperature that a reading means [degC]; none where it means none.
    pub(crate) fn celsius(self, value: f64) -> Option<f64> {
        match self {
            Scale::Celsius => Some(value).filter(|v| POSSIBLE_C.contains(v)),
            Scale::Kelvin => Some(value).filter(|v| KELVIN.contains(v)).map(|v| v - ZERO_C_K),
            Scale::Mixed => None,
        }
    }
}

/// What is to be said of readings that would be a room's in degrees Fahrenheit.
pub(crate) fn like_fahrenheit(celsius: &[f64]) -> Option<String> {
    let least = celsius.iter().copied().fold(f64::INFINITY, f64::min);
    let most = celsius.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let to_c = |f: f64| (f - 32.0) / 1.8;
    (ROOM_F.contains(&least) && ROOM_F.contains(&most)).then(|| {
        format!(
            "reads {least:.1} to {most:.1} degC and is taken so; in degrees Fahrenheit that would be {:.1} to {:.1} degC: if \
             the thermometer writes those, convert them, or every effect of temperature comes out 1.8 times too small",
            to_c(least),
            to_c(most)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentinels_are_no_readings_and_kelvin_is_converted_where_it_is_certain() {
        let taken = |values: &[f64]| -> Vec<Option<f64>> {
            let scale = Scale::of(values);
            values.iter().map(|v| scale.celsius(*v)).collect()
        };
        assert_eq!(
            taken(&[21.5, -999.0, 22.0, 32767.0, -127.0, 1e38]),
            [Some(21.5), None, Some(22.0), None, None, None]
        );
        assert_eq!(taken(&[293.15, 294.15, -999.0]), [Some(20.0), Some(21.0), None]);
        // A hot reading among others is none, and of both kinds neither is believed.
        assert_eq!(taken(&[20.0, 21.0, 295.0]), [Some(20.0), Some(21.0), None]);
        assert_eq!(taken(&[0.0, 293.0, 294.0]), [None, None, None]);
        assert_eq!(taken(&[150.0, 150.1]), [Some(150.0), None]);
        assert_eq!(taken(&[-999.0, -999.0, -999.0, 300.0]), [None, None, None, None]);
    }

    #[test]
    fn a_room_in_fahrenheit_is_pointed_out_and_a_room_in_celsius_is_not() {
        let said = like_fahrenheit(&[68.0, 77.0]).expect("a room in Fahrenheit");
        assert!(said.contains("20.0 to 25.0 degC"), "{said}");
        assert_eq!(like_fahrenheit(&[20.0, 70.0]), None);
        assert_eq!(like_fahrenheit(&[]), None);
    }
}
