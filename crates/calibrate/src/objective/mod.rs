//! What is minimised: residuals and priors of a problem in the units of its solver, and the solver.

pub(crate) mod alike;
pub(crate) mod axes;
pub(crate) mod frame_names;
pub(crate) mod joined;
pub(crate) mod linearise;
pub(crate) mod loss;
pub(crate) mod model_problem;
pub(crate) mod noise;
pub(crate) mod poses;
pub mod problem;
pub(crate) mod products;
pub(crate) mod remembered;
pub(crate) mod robust;
pub(crate) mod rows;
pub(crate) mod solver;
pub(crate) mod structure;
pub(crate) mod whitened;
pub(crate) mod with_priors;
