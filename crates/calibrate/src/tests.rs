//! Tests of the whole crate, one question a file.

mod against; // do a ballbar, a gauge and a point without a camera recover what is planted?
mod covariance; // is a covariance kept in parts the dense one?
mod coverage; // do 95 % intervals hold 95 % of planted truths, and are parallel axes reported?
mod frames; // are frames metres and half turns off found?
mod holdout; // does the fit never see what is held out?
mod holdout_turns; // which observations does each kind of hold-out mean?
mod joined; // do two arms of the lab with joined tips recover what is planted in both?
pub mod linear; // is the answer of a linear problem the textbook's?
mod markers; // do several markers a pose share noise, hold-out and weight?
mod paper; // is eq. 4 solved to its optimality conditions?
mod pooled; // has a pool solved recording by recording the optimum of one dense fit?
mod refusals; // does impossible input get an error that names it?
pub mod rig; // the planted arm of these tests
mod robust; // do outliers leave the answer alone?
mod slack; // is where a joint rests in its gap noise of known size?
mod solvers; // do SciPy and basin find the same optimum, and how fast?
