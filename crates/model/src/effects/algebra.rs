//! What a formula can be evaluated over, and the operators it has there.

use exmex::{BinOp, MakeOperators, Operator};
use std::marker::PhantomData;
use std::str::FromStr;

/// The functions of a formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    Sin,
    Cos,
    Tan,
    Atan,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    Abs,
    Sign,
}

pub(super) const FUNCTIONS: [&str; 10] =
    ["sin", "cos", "tan", "atan", "tanh", "exp", "ln", "sqrt", "abs", "sign"];

/// What a formula can be evaluated over.
pub(super) trait Algebra: Clone + FromStr + std::fmt::Debug + Default + Send + Sync + 'static {
    fn number(value: f64) -> Self;
    fn add(self, other: Self) -> Self;
    fn subtract(self, other: Self) -> Self;
    fn multiply(self, other: Self) -> Self;
    fn divide(self, other: Self) -> Self;
    fn power(self, exponent: Self) -> Self;
    fn negate(self) -> Self;
    fn apply(self, function: Function) -> Self;
}

/// The operators of a formula over any algebra.
#[derive(Debug, Clone)]
pub(super) struct Operators<T>(PhantomData<T>);

impl<T: Algebra> MakeOperators<T> for Operators<T> {
    fn make<'a>() -> Vec<Operator<'a, T>> {
        let bin = |apply, prio, is_commutative| BinOp { apply, prio, is_commutative };
        vec![
            Operator::make_bin("^", bin(T::power, 4, false)),
            Operator::make_bin("*", bin(T::multiply, 2, true)),
            Operator::make_bin("/", bin(T::divide, 3, false)),
            Operator::make_bin_unary("+", bin(T::add, 0, true), |a| a),
            Operator::make_bin_unary("-", bin(T::subtract, 1, false), T::negate),
            Operator::make_unary("sin", |a| a.apply(Function::Sin)),
            Operator::make_unary("cos", |a| a.apply(Function::Cos)),
            Operator::make_unary("tan", |a| a.apply(Function::Tan)),
            Operator::make_unary("atan", |a| a.apply(Function::Atan)),
            Operator::make_unary("tanh", |a| a.apply(Function::Tanh)),
            Operator::make_unary("exp", |a| a.apply(Function::Exp)),
            Operator::make_unary("ln", |a| a.apply(Function::Ln)),
            Operator::make_unary("sqrt", |a| a.apply(Function::Sqrt)),
            Operator::make_unary("abs", |a| a.apply(Function::Abs)),
            Operator::make_unary("sign", |a| a.apply(Function::Sign)),
            Operator::make_constant("pi", T::number(std::f64::consts::PI)),
        ]
    }
}
