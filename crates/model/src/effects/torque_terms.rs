//! Gravity torque with unknown masses: one amplitude for the links, one more for the share of the outer links,
//! one for the load.

use super::context::amplitude;
use super::drivers::Torque;
use super::kind::EffectContext;
use crate::rigid::Scalar;
use armcal_core::{Parameter, Unit};

/// How uncertain the share of the outer links is, relative to the whole.
const OUTER_SHARE: f64 = 0.5;

/// Which shares of the torque have amplitudes of their own, in this order: links, outer, load.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TorqueTerms {
    outer: bool,
    load: bool,
}

impl TorqueTerms {
    /// The shares of a joint: the outer links where there are any, the load where the session has one.
    pub fn of(context: &EffectContext<'_>, joint: usize) -> TorqueTerms {
        TorqueTerms { outer: !context.zero.outer(joint).is_empty(), load: context.session.load }
    }

    /// The amplitudes: `quantity`, `quantity_outer`, `quantity_load`.
    pub fn amplitudes(
        self,
        quantity: &str,
        unit: Unit,
        prior_sigma: f64,
        bound: f64,
        meaning: &str,
    ) -> Vec<Parameter> {
        let mut all = vec![amplitude(quantity, unit, prior_sigma, bound, meaning)];
        if self.outer {
            let meaning = format!("{meaning}: correction for the unknown mass of the outer links");
            let sigma = OUTER_SHARE * prior_sigma;
            all.push(amplitude(&format!("{quantity}_outer"), unit, sigma, bound, meaning));
        }
        if self.load {
            let meaning = format!("{meaning}: under the load at the tip");
            all.push(amplitude(&format!("{quantity}_load"), unit, prior_sigma, bound, meaning));
        }
        all
    }

    /// How many amplitudes there are.
    pub fn count(self) -> usize {
        1 + usize::from(self.outer) + usize::from(self.load)
    }

    /// The amplitudes times their shares of the torque.
    pub fn sum<D: Scalar>(self, theta: &[D], links: f64, outer: f64, load: f64) -> D {
        let mut sum = theta[0] * links;
        let mut rest = theta[1..].iter();
        if self.outer {
            sum += rest.next().map_or(D::from(0.0), |own| *own * outer);
        }
        if self.load {
            sum += rest.next().map_or(D::from(0.0), |own| *own * load);
        }
        sum
    }

    /// [`TorqueTerms::sum`] of a torque.
    pub fn torque<D: Scalar>(self, theta: &[D], torque: &Torque) -> D {
        self.sum(theta, torque.links_nm, torque.outer_nm, torque.load_nm)
    }
}
