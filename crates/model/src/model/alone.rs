//! One of several arms by itself: what its model file can hold.

use super::Model;
use super::features::Feature;
use crate::arms::Arm;
use crate::segment::Segment;
use armcal_core::Parameter;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Model {
    /// One of several arms between its frames, without effects, its names without its prefix; and the index that each of its
    /// parameters has in this model. `None` where there is no such arm.
    pub fn arm_alone(&self, arm: usize) -> Option<(Model, Vec<usize>)> {
        let own = self.chain.arms().get(arm)?;
        let (base, tip) = (&self.tree.0[arm], self.tip_segment(arm));
        let index: Vec<usize> =
            own.parameters.clone().chain(base.parameters.clone()).chain(tip.parameters.clone()).collect();
        let base = own.alone(base, own.parameters.len());
        let tip = own.alone(tip, base.parameters.end);
        let mut tree = own.chain.on(vec![base]);
        let name = tip.frame.clone().unwrap_or_default();
        tree.0.push(Segment { parent: own.chain.ends().first().copied(), ..tip });
        let features = vec![Feature { name, link: None, route: tree.route(tree.0.len() - 1) }];
        let parameter = |i: &usize| {
            let p = &self.parameters[*i];
            Parameter { name: own.without_prefix(&p.name).to_owned(), ..p.clone() }
        };
        let model = Model {
            chain: own.chain.clone(),
            parameters: index.iter().map(parameter).collect(),
            tree,
            features,
            fixed: Vec::new(),
            lengths: Vec::new(),
            boards: BTreeMap::new(),
            effects: None,
            declared: Arc::default(),
            scopes: None,
            own_asked: None,
        };
        Some((model, index))
    }
}

impl Arm {
    /// A name without that of the arm before it.
    pub fn without_prefix<'n>(&self, name: &'n str) -> &'n str {
        name.strip_prefix(self.name.as_str()).and_then(|rest| rest.strip_prefix('.')).unwrap_or(name)
    }

    /// A frame whose parameters start elsewhere.
    fn alone(&self, frame: &Segment, first: usize) -> Segment {
        Segment {
            parent: None,
            frame: frame.frame.as_ref().map(|name| self.without_prefix(name).to_owned()),
            parameters: first..first + frame.parameters.len(),
            ..frame.clone()
        }
    }
}
