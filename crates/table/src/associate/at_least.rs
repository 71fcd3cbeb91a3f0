//! Sums that only matter where they reach something: most alignments and planes that are tried are nowhere near.

/// Sums are rounded, those of what is to come too.
const ROUNDED: f64 = 1e-9;

/// The sum of weight times value; none once what is to come, of a `whole` weight of values up to `most`, cannot bring it to
/// `least`. A value is asked for only while it can.
pub(super) fn sum_of_at_least(
    least: f64,
    (whole, most): (f64, f64),
    terms: impl Iterator<Item = (f64, f64)>,
) -> Option<f64> {
    let enough = least - ROUNDED * (least.abs() + whole * most.abs());
    let (mut sum, mut to_come) = (0.0, whole);
    for (weight, value) in terms {
        sum += weight * value;
        to_come -= weight;
        if sum + to_come * most < enough {
            return None;
        }
    }
    Some(sum)
}
