//! What is said of one arm by itself, in the names and numbers of all arms that it stands among.

use super::context::ARM;
use super::is_of_effect;
use super::spec::{EffectSpec, Expression};
use crate::{Arm, ModelError};

/// The variables of a formula that have the number of a joint behind them.
const OF_JOINTS: [&str; 4] = ["q", "s", "tau", "effort"];

impl Arm {
    /// A parameter, or a pattern of some, as this arm by itself calls it.
    pub fn parameter_among_all(&self, name: &str) -> String {
        if !is_of_effect(name) {
            return format!("{}.{name}", self.name);
        }
        // `backlash:2.width`: the joint is that of this arm.
        let numbered = name.split_once(':').and_then(|(kind, rest)| {
            let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
            let joint: usize = rest[..digits].parse().ok()?;
            Some(format!("{kind}:{}{}", joint + self.joints.start, &rest[digits..]))
        });
        numbered.unwrap_or_else(|| name.to_owned())
    }

    /// An effect, its joints numbered as in this arm by itself; `number` is that of the arm, from 1.
    ///
    /// # Errors
    /// A kind that there is not.
    pub fn effect_among_all(&self, number: usize, spec: EffectSpec) -> Result<EffectSpec, ModelError> {
        let kind = spec.kind()?;
        let target = spec.target.map(|joint| joint + self.joints.start);
        let expression = spec.expression.as_ref().map(|own| self.expression_among_all(own));
        let mut all = EffectSpec { target, expression, ..spec };
        for (name, value) in &mut all.shape {
            if kind.name == "crossed_backlash" && name == "from" {
                *value += self.joints.start as f64;
            }
        }
        match kind.shapes.iter().any(|shape| shape.name == ARM.name) {
            true => Ok(all.with(ARM.name, number as f64)),
            false => Ok(all),
        }
    }

    fn expression_among_all(&self, own: &Expression) -> Expression {
        let known = |name: &str| {
            let names =
                self.chain.joint_names().iter().chain(self.chain.parameters().iter().map(|p| &p.name));
            names.map(String::as_str).any(|own| own == name)
                || ["base.", "tip."].iter().any(|frame| name.starts_with(frame))
        };
        let acts_on = match known(&own.acts_on) {
            true => format!("{}.{}", self.name, own.acts_on),
            false => self.renumbered(&own.acts_on),
        };
        Expression { name: own.name.clone(), formula: self.renumbered(&own.formula), acts_on }
    }

    /// A formula with the variables of its joints numbered among all.
    fn renumbered(&self, formula: &str) -> String {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let mut text = String::with_capacity(formula.len());
        let mut rest = formula;
        while !rest.is_empty() {
            let word = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            let own = &rest[..word];
            let numbered = OF_JOINTS.iter().find_map(|prefix| {
                let joint: usize = own.strip_prefix(prefix)?.parse().ok()?;
                Some(format!("{prefix}{}", joint + self.joints.start))
            });
            text.push_str(numbered.as_deref().unwrap_or(own));
            let between = rest[word..].find(is_word).map_or(rest.len(), |at| word + at);
            text.push_str(&rest[word..between]);
            rest = &rest[between..];
        }
        text
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;
    use crate::Chain;
    use std::path::Path;

    const DH: &str = r#"
        name = "two joints"
        convention = "standard"
        [[rows]]
        name = "joint1"
        theta_deg = 0.0
        d_mm = 0.0
        a_mm = 300.0
        alpha_deg = 0.0
        joint = "revolute"
        [[rows]]
        name = "joint2"
        theta_deg = 0.0
        d_mm = 0.0
        a_mm = 300.0
        alpha_deg = 0.0
        joint = "revolute"
    "#;

    #[test]
    fn joints_of_the_second_arm_are_numbered_behind_the_first() {
        let chain = |_| Chain::from_dh_toml(DH, Path::new("dh.toml")).unwrap();
        let all =
            Chain::joined(["right", "left"].map(|name| (name.to_owned(), chain(name))).to_vec()).unwrap();
        let left = &all.arms()[1];
        assert_eq!(left.parameter_among_all("joint2.a"), "left.joint2.a");
        assert_eq!(left.parameter_among_all("backlash:2.width"), "backlash:4.width");
        assert_eq!(left.parameter_among_all("sensor_scale.*"), "sensor_scale.*");
        let spec = |text: &str| {
            let own = EffectSpec::parse(text, left.chain.joint_names()).unwrap();
            left.effect_among_all(2, own).unwrap().to_string()
        };
        assert_eq!(spec("backlash:joint2"), "backlash:4");
        assert_eq!(spec("crossed_backlash:1,from=2"), "crossed_backlash:3,from=4");
        assert_eq!(spec("tool_shift@0.7"), "tool_shift@0.7,arm=2");
        assert_eq!(
            left.renumbered("k * sin(q1 + 2*q2) + tau1^2 + t - sq1"),
            "k * sin(q3 + 2*q4) + tau3^2 + t - sq1"
        );
        let own = Expression { name: "e".into(), formula: "k".into(), acts_on: "joint1".into() };
        assert_eq!(left.expression_among_all(&own).acts_on, "left.joint1");
    }
}
