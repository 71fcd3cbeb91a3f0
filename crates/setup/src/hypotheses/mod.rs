//! The mistakes that are tried, each as the one change of the inputs that would undo it.

mod board;
mod drives;
mod frames;
mod joints;
mod model;
mod parts;
mod poses;
mod readings;
mod zeros;

use armcal_core::{Code, Mend, Parameter};
use armcal_stages::Inputs;
pub use drives::bounded_amplitude;
pub use joints::sign_reversal;
use std::sync::Arc;

/// A mistake that somebody may have made.
#[derive(Clone)]
pub struct Hypothesis {
    /// Stable name, `kebab-case`.
    pub code: Code,
    /// What it is about.
    pub subject: String,
    /// The change that undoes it, to stand behind "with": `joint 2's sign reversed`.
    pub change: String,
    /// Where to make the change.
    pub remedy: &'static str,
    /// How much freedom the change takes.
    pub freedom: Freedom,
    /// The number that the change holds, where it holds one.
    pub number: Option<Number>,
    /// Parameters that the fit estimates for the change; it is no mistake unless one of them comes out far off.
    pub estimated: Vec<Estimated>,
    /// The recording that it leaves out, where it leaves one out.
    pub recording: Option<usize>,
    /// What makes the change where recordings are read, where a key does.
    pub mending: Option<Mending>,
    /// The change itself.
    pub apply: Arc<dyn Fn(&mut Inputs) + Send + Sync>,
}

/// What makes a change where recordings are read.
#[derive(Debug, Clone)]
pub enum Mending {
    /// These keys.
    Keys(Mend),
    /// These zeros of joints, by what their parameters come out as, beside what was known of the readings.
    Zeros {
        /// By joint its parameter, and the sign with which that adds to the reading.
        of: Vec<(usize, String, f64)>,
        /// A factor a joint, and what is added to each reading [rad].
        known: (Vec<f64>, Vec<f64>),
    },
}

impl Mending {
    /// The zeros of these joints.
    fn zeros(inputs: &Inputs, joints: impl IntoIterator<Item = usize>) -> Mending {
        let n = inputs.chain.joint_names().len();
        let own = |j: usize| inputs.chain.joint_zero(j).map(|(p, sign)| (j, p.name.clone(), sign));
        Mending::Zeros {
            of: joints.into_iter().filter_map(own).collect(),
            known: (vec![1.0; n], vec![0.0; n]),
        }
    }
}

/// A number of which a few values are tried; the best one is then refined between its neighbours.
#[derive(Clone)]
pub struct Number {
    /// The value tried.
    pub value: f64,
    /// Its neighbours.
    pub between: [f64; 2],
    /// The value that changes nothing, and how far from it a value is beyond what any effect does.
    pub nothing: f64,
    /// That distance.
    pub far: f64,
    /// The hypothesis of another value.
    pub at: Arc<dyn Fn(f64) -> Hypothesis + Send + Sync>,
}

/// A parameter that is estimated, and how far from its nominal value it is beyond what any effect does.
#[derive(Debug, Clone)]
pub struct Estimated {
    /// Its name.
    pub parameter: String,
    /// What it is taken to be, SI.
    pub nominal: f64,
    /// That distance, SI.
    pub far: f64,
}

/// A parameter that leaves its bounds is a mistake if it comes out this many times as far.
const FAR_BOUNDS: f64 = 1.1;

impl Estimated {
    fn of(p: &Parameter, far: f64) -> Estimated {
        Estimated { parameter: p.name.clone(), nominal: p.nominal, far }
    }

    /// A parameter that the fit left on its bound.
    fn beyond(p: &Parameter) -> Estimated {
        Estimated::of(p, FAR_BOUNDS * (p.upper - p.nominal).abs())
    }
}

/// How much freedom a change takes. Of two that fit alike, the one with less is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Freedom {
    /// One of a few: a sign, an order, a unit.
    Discrete,
    /// A number that is estimated.
    Number,
    /// A frame or many numbers that are estimated.
    Frame,
}

impl Hypothesis {
    fn new(
        code: Code,
        subject: impl Into<String>,
        change: impl Into<String>,
        remedy: &'static str,
        apply: impl Fn(&mut Inputs) + Send + Sync + 'static,
    ) -> Hypothesis {
        let (subject, change) = (subject.into(), change.into());
        Hypothesis {
            code,
            subject,
            change,
            remedy,
            freedom: Freedom::Discrete,
            number: None,
            estimated: Vec::new(),
            recording: None,
            mending: None,
            apply: Arc::new(apply),
        }
    }

    /// The same hypothesis for each value of a number, in rising order; `nothing` is among them and is not tried.
    fn of_each(
        values: &[f64],
        nothing: f64,
        far: f64,
        at: impl Fn(f64) -> Hypothesis + Send + Sync + 'static,
    ) -> Vec<Hypothesis> {
        let at: Arc<dyn Fn(f64) -> Hypothesis + Send + Sync> = Arc::new(at);
        let inner = values.windows(3).filter(|w| w[1] != nothing);
        inner
            .map(|w| {
                let number = Number { value: w[1], between: [w[0], w[2]], nothing, far, at: at.clone() };
                Hypothesis { number: Some(number), freedom: Freedom::Number, ..at(w[1]) }
            })
            .collect()
    }

    fn mended_by(self, mend: Mend) -> Hypothesis {
        Hypothesis { mending: Some(Mending::Keys(mend)), ..self }
    }

    fn with(self, freedom: Freedom) -> Hypothesis {
        Hypothesis { freedom, ..self }
    }

    fn estimating(self, freedom: Freedom, estimated: Vec<Estimated>) -> Hypothesis {
        Hypothesis { freedom, estimated, ..self }
    }

    /// Whether it lets the model's own parameters go.
    pub fn of_the_model(&self) -> bool {
        !self.estimated.is_empty()
            && [Code::ParameterBound, Code::ParameterFixed, Code::JointZero].contains(&self.code)
    }

    /// The inputs without the mistake.
    pub fn undone(&self, inputs: &Inputs) -> Inputs {
        let mut changed = inputs.clone();
        (self.apply)(&mut changed);
        changed
    }
}

/// Everything worth trying on these inputs, what is rarer apart: to be tried where nothing of the first explains the errors.
/// `at_bound` are parameters that the fit left on their bounds, `gross` whether it knows hardly more of the arm than where it is.
pub fn hypotheses_by_rarity(inputs: &Inputs, at_bound: &[Parameter], gross: bool) -> [Vec<Hypothesis>; 2] {
    let mut all = joints::hypotheses(inputs);
    all.extend(poses::hypotheses(inputs));
    all.extend(readings::hypotheses(inputs));
    all.extend(board::hypotheses(inputs));
    all.extend(model::hypotheses(inputs, at_bound));
    all.extend(frames::hypotheses(inputs));
    let mut rarer = parts::hypotheses(inputs, &all);
    rarer.extend(drives::hypotheses(inputs));
    rarer.extend(zeros::hypotheses(inputs, at_bound, gross));
    rarer.extend(drives::let_go(inputs));
    rarer.extend(model::of_another_size(inputs));
    if gross {
        rarer.extend(drives::common_units(inputs));
        rarer.extend(joints::cycles(inputs));
        rarer.extend(poses::other_sizes(inputs));
        rarer.extend(model::of_another_axis(inputs));
    }
    rarer.extend(board::from_the_other_side(inputs));
    [all, rarer]
}
