//! Formulas as text: read by exmex, evaluated over dual numbers and over units by the same list of operators.

use super::algebra::{Algebra, FUNCTIONS, Function, Operators};
use super::measure::Measure;
use crate::error::similar_name_hint;
use exmex::{Express, FlatEx, MatchLiteral};
use num_dual::{Dual64, DualNum};
use std::str::FromStr;

/// Longest formula; reading one takes the square of its length, so of many the time is in proportion with the longest.
const LONGEST: usize = 1000;
/// Most signs that a number, a name or a parenthesis may have before it.
const MOST_SIGNS: usize = 8;

/// Finds the numbers of a formula, also those such as `1.5e-3`, which exmex's own matcher does not take.
#[derive(Debug, Clone)]
struct Literals;

impl MatchLiteral for Literals {
    fn is_literal(text: &str) -> Option<&str> {
        let digits = |from: usize| {
            let rest = text.get(from..).unwrap_or_default();
            from + rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len())
        };
        let mut end = digits(0);
        let mut count = end;
        if text[end..].starts_with('.') {
            let fraction = digits(end + 1);
            count += fraction - end - 1;
            end = fraction;
        }
        if count == 0 {
            return None;
        }
        if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let after = digits(end + 1 + sign);
            if after > end + 1 + sign {
                end = after;
            }
        }
        Some(&text[..end])
    }
}

/// A formula that has been read.
#[derive(Debug, Clone)]
pub(super) struct Formula {
    value: FlatEx<Number, Operators<Number>, Literals>,
    unit: FlatEx<Measure, Operators<Measure>, Literals>,
}

impl Formula {
    /// Reads a formula; what is wrong otherwise.
    pub fn read(text: &str) -> Result<Formula, String> {
        check_characters(text)?;
        check_functions(text)?;
        check_minus(text)?;
        let said = |cause: exmex::ExError| format!("the formula \"{text}\" cannot be read: {cause}");
        Ok(Formula { value: FlatEx::parse(text).map_err(said)?, unit: FlatEx::parse(text).map_err(said)? })
    }

    /// Names of its variables, in the order in which it takes their values.
    pub fn variables(&self) -> &[String] {
        self.value.var_names()
    }

    /// Its value; NaN for the wrong number of variables.
    pub fn value(&self, variables: &[Number]) -> Dual64 {
        self.value.eval(variables).map_or(Dual64::from(f64::NAN), |number| number.0)
    }

    /// The unit of its value, as far as it can be told.
    pub fn measure(&self, variables: &[Measure]) -> Measure {
        self.unit.eval(variables).unwrap_or(Measure::Anything)
    }
}

fn check_characters(text: &str) -> Result<(), String> {
    let belongs = |c: char| c.is_ascii_alphanumeric() || "_.+-*/^() ".contains(c);
    if text.trim().is_empty() {
        return Err("the formula is empty".to_owned());
    }
    if text.len() > LONGEST {
        return Err(format!("the formula has {} characters; at most {LONGEST} are read", text.len()));
    }
    let mut signs = 0;
    for c in text.chars().filter(|c| *c != ' ') {
        signs = if matches!(c, '+' | '-') { signs + 1 } else { 0 };
        if signs > MOST_SIGNS {
            return Err(format!("the formula has more than {MOST_SIGNS} signs in a row; write one or none"));
        }
    }
    match text.chars().find(|c| !belongs(*c)) {
        Some(other) => {
            Err(format!("the formula \"{text}\" has a {other:?}; it takes names, numbers and + - * / ^ ( )"))
        }
        None => Ok(()),
    }
}

/// Names in a formula with where they end.
fn split_words(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let mut rest = text;
    std::iter::from_fn(move || {
        rest = rest.trim_start_matches(|c| !is_word(c));
        let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        rest = after;
        (!word.is_empty()).then_some((word, after))
    })
}

fn check_functions(text: &str) -> Result<(), String> {
    let called =
        |(word, after): &(&str, &str)| after.trim_start().starts_with('(') && !FUNCTIONS.contains(word);
    let Some((word, _)) = split_words(text).find(called) else { return Ok(()) };
    let hint = similar_name_hint(word, FUNCTIONS.into_iter());
    let known = FUNCTIONS.join(", ");
    Err(format!(
        "the formula \"{text}\" calls \"{word}\", which is no function{hint} The functions are {known}"
    ))
}

/// exmex reads `-x^2` as `(-x)^2`, everybody else as `-(x^2)`: such a formula must say which it means.
fn check_minus(text: &str) -> Result<(), String> {
    for (at, _) in text.match_indices('-') {
        let before = text[..at].trim_end().chars().last();
        let leading = before.is_none_or(|c| "(+-*/^".contains(c));
        let powered = split_words(&text[at..]).next().is_some_and(|(word, after)| {
            text[at + 1..].trim_start().starts_with(word) && after.trim_start().starts_with('^')
        });
        if leading && powered {
            return Err(format!("the formula \"{text}\" has a minus before a power; say -(x^n) or (-x)^n"));
        }
    }
    Ok(())
}

/// A dual number as exmex wants it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number(pub Dual64);

impl Default for Number {
    fn default() -> Number {
        Number::number(0.0)
    }
}

impl FromStr for Number {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Number, Self::Err> {
        Ok(Number(Dual64::from(text.parse::<f64>()?)))
    }
}

impl Algebra for Number {
    fn number(value: f64) -> Number {
        Number(Dual64::from(value))
    }

    fn add(self, other: Number) -> Number {
        Number(self.0 + other.0)
    }

    fn subtract(self, other: Number) -> Number {
        Number(self.0 - other.0)
    }

    fn multiply(self, other: Number) -> Number {
        Number(self.0 * other.0)
    }

    fn divide(self, other: Number) -> Number {
        Number(self.0 / other.0)
    }

    fn power(self, exponent: Number) -> Number {
        if exponent.0.eps == 0.0 {
            // Also right for a negative base and an integer exponent.
            let exponent = exponent.0.re;
            let slope = if exponent == 0.0 { 0.0 } else { exponent * self.0.re.powf(exponent - 1.0) };
            let eps = if self.0.eps == 0.0 { 0.0 } else { slope * self.0.eps };
            return Number(Dual64::new(self.0.re.powf(exponent), eps));
        }
        Number((self.0.ln() * exponent.0).exp())
    }

    fn negate(self) -> Number {
        Number(-self.0)
    }

    fn apply(self, function: Function) -> Number {
        let x = self.0;
        Number(match function {
            Function::Sin => x.sin(),
            Function::Cos => x.cos(),
            Function::Tan => x.tan(),
            Function::Atan => x.atan(),
            Function::Tanh => x.tanh(),
            Function::Exp => x.exp(),
            Function::Ln => x.ln(),
            Function::Sqrt => x.sqrt(),
            Function::Abs if x.re < 0.0 => -x,
            Function::Abs => x,
            Function::Sign if x.re == 0.0 => Dual64::from(0.0),
            Function::Sign => Dual64::from(x.re.signum()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str, variables: &[f64]) -> f64 {
        let numbers: Vec<Number> = variables.iter().map(|x| Number::number(*x)).collect();
        Formula::read(text).expect("a formula").value(&numbers).re
    }

    #[test]
    fn signs_in_a_row_and_long_formulas_are_refused() {
        let refused = |text: String| Formula::read(&text).err().unwrap_or_default();
        assert!(!refused(format!("{}x", "-".repeat(8))).contains("signs in a row"));
        assert!(refused(format!("{}x", "- ".repeat(9))).contains("signs in a row"));
        assert!(refused(format!("{}x", "-".repeat(9000))).contains("at most 1000 are read"));
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "[qk12.eE+*/^() -]{0,24}") {
            if let Ok(formula) = Formula::read(&text) {
                let count = formula.variables().len();
                let _ = formula.value(&vec![Number::number(0.3); count]);
                let _ = formula.measure(&vec![Measure::Known([1.0, 0.0, 0.0, 0.0]); count]);
            }
            let _ = Formula::read("k * \u{fc}");
        }
    }

    #[test]
    fn operators_bind_as_people_read_them() {
        assert_eq!(value("2 - 3 - 4", &[]), -5.0);
        assert_eq!(value("2 / 4 / 2", &[]), 0.25);
        assert_eq!(value("2 / 4 * 2", &[]), 1.0);
        assert_eq!(value("2 + 3 * 2^2", &[]), 14.0);
        assert_eq!(value("2 - 3 + 4", &[]), 3.0);
        assert_eq!(value("-(2^2)", &[]), -4.0);
        assert_eq!(value("2 * -3", &[]), -6.0);
        assert_eq!(value("1.5e-3 * 2 + .5E1 - 1e2 + 3.", &[]), 3e-3 + 5.0 - 100.0 + 3.0);
        assert!(Formula::read("2e * 3").is_err());
        assert!(Formula::read(&"1+".repeat(5001)).is_err_and(|why| why.contains("10002 characters")));
        assert_eq!(value("b - a", &[1.0, 5.0]), 4.0);
        assert!((value("sin(pi / 2) + cos(0)", &[]) - 2.0).abs() < 1e-15);
        assert_eq!(value("abs(-3) * sign(-2)", &[]), -3.0);
    }

    #[test]
    fn derivatives_are_the_textbooks() {
        let slope = |text: &str, x: f64| {
            Formula::read(text).expect("a formula").value(&[Number(Dual64::new(x, 1.0))]).eps
        };
        let close = |a: f64, b: f64| (a - b).abs() < 1e-13;
        assert!(close(slope("x^3", -2.0), 12.0) && close(slope("2^x", 3.0), 8.0 * 2f64.ln()));
        assert!(
            close(slope("tanh(x)", 0.3), 1.0 - 0.3f64.tanh().powi(2)) && close(slope("abs(x)", -1.0), -1.0)
        );
        assert!(close(slope("x^0", 0.0), 0.0) && close(slope("sqrt(x)", 4.0), 0.25));
    }
}
