//! One fit from nominal on one core, beside scipy and Ceres on the same problem, with the same optimum.

use crate::clock::{Spent, median, spent};
use crate::fit_problem::{Problem, Session};
use crate::page::{Bar, Section, Table};
use crate::peers::{self, Python, number, single_threaded};
use crate::{Options, Result};
use armcal_calibrate::{Fit, Objective, fit};
use serde_json::Value;

/// Repetitions of armcal's fit before, between and after its peers.
const REPETITIONS: usize = 100;
/// armcal's cost may exceed the lowest by this share.
const SAME_COST: f64 = 1e-9;

/// A solver's answer.
struct Answer {
    who: String,
    spent: Spent,
    evaluations: usize,
    cost: f64,
    /// The cost may exceed the lowest of all by this share.
    same_cost: f64,
}

pub fn section(options: &Options) -> Result<Section> {
    let session = Session::observe()?;
    let mut section = Section::new("Fit");
    let free = session.problem(Objective::LeastSquares)?.free();
    section.say(format!(
        "{} dwells of the paper's experiment from the lab's quick path, {free} free parameters with priors and bounds, from \
         nominal, one core. armcal's time is that of `fit` as the program calls it: checks, whitening, optimum, covariance, \
         intervals and what is undetermined. The peers are given the whitened problem and only solve it; with the robust \
         loss they are also given the residual scale, which armcal finds by itself. Reading files and starting processes \
         are not counted. Medians of many repetitions.",
        session.observations.len(),
    ));
    section.say(
        "scipy evaluates all dwells at once in numpy. Ceres differentiates by Jets (`AutoDiffCostFunction`) and has Huber's \
         loss on the norm of a dwell; scipy gets the dwell stretched so that half its square is that loss. scipy keeps its \
         own tolerances, Ceres gets 1e-12 because its own stop short of the optimum. Every answer is judged by armcal's cost \
         function, and the run fails unless all are equal to 1e-9, or 1e-8 where scipy differentiates by differences.",
    );
    let python = Python::find(options)?;
    let ceres = peers::ceres(options);
    if python.is_none() {
        section.skipped("scipy: no Python with `benches/peers/requirements.txt` could be made");
    }
    if ceres.is_none() {
        section.skipped("Ceres: `apt-get install g++ libceres-dev` provides it");
    }
    for (name, objective) in [("least squares", Objective::LeastSquares), ("robust", Objective::Robust)] {
        let problem = session.problem(objective)?;
        let (mut own, mut answers) = (Own::default(), Vec::new());
        own.measure(&session, &problem)?;
        let file = options.data.join(format!("fit-{}.json", name.replace(' ', "-")));
        if let Some(python) = &python {
            std::fs::write(&file, problem.json()?.to_string())?;
            let said = python.run("fit_scipy.py", &file)?;
            answers.extend(theirs("scipy", &said, &problem, Ok)?);
            own.measure(&session, &problem)?;
        }
        if let Some(ceres) = &ceres {
            let file = file.with_extension("txt");
            std::fs::write(&file, problem.numbers()?)?;
            let said = peers::json(single_threaded(ceres).arg(&file))?;
            let version = said[0]["version"].as_str().unwrap_or_default();
            let in_order = |values: Vec<f64>| problem.in_own_order(&values);
            answers.extend(theirs(&format!("Ceres {version}"), &said, &problem, in_order)?);
            own.measure(&session, &problem)?;
        }
        judge(name, &own.answer(&problem)?, &answers, &mut section)?;
    }
    Ok(section)
}

/// armcal's fits, at several moments: a machine's speed changes while the peers work.
#[derive(Default)]
struct Own {
    last: Option<Fit>,
    each: Vec<Spent>,
    cpu_s: f64,
}

impl Own {
    fn measure(&mut self, session: &Session, problem: &Problem<'_>) -> Result<()> {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let once = || one.install(|| fit(&session.model, &session.observations, &problem.config));
        self.last = Some(once()?);
        // The system counts processor time in ticks of milliseconds: only that of many fits is known.
        let (fitted, all) = spent(|| {
            (0..REPETITIONS).try_for_each(|_| {
                let (fitted, took) = spent(once);
                self.each.push(took);
                fitted.map(drop)
            })
        });
        self.cpu_s += all.cpu_s;
        Ok(fitted?)
    }

    fn answer(&self, problem: &Problem<'_>) -> Result<Answer> {
        let last = self.last.as_ref().ok_or("nothing was measured")?;
        let cpu_s = self.cpu_s / self.each.len() as f64;
        Ok(Answer {
            who: "armcal".into(),
            spent: Spent { wall_s: median(&self.each).wall_s, cpu_s },
            evaluations: last.iterations,
            cost: problem.cost(&last.values())?,
            same_cost: SAME_COST,
        })
    }
}

fn theirs(
    who: &str,
    said: &Value,
    problem: &Problem<'_>,
    in_order: impl Fn(Vec<f64>) -> Result<Vec<f64>>,
) -> Result<Vec<Answer>> {
    let answer = |one: &Value| {
        let values: Vec<f64> = serde_json::from_value(one["values"].clone())?;
        Ok(Answer {
            who: format!("{who}: {}", one["how"].as_str().unwrap_or_default()),
            spent: Spent { wall_s: number(one, "wall_s")?, cpu_s: number(one, "cpu_s")? },
            evaluations: number(one, "evaluations")? as usize,
            cost: problem.cost(&in_order(values)?)?,
            same_cost: number(one, "same_cost")?,
        })
    };
    said.as_array().into_iter().flatten().map(answer).collect()
}

fn judge(name: &str, ours: &Answer, peers: &[Answer], section: &mut Section) -> Result<()> {
    let answers = || std::iter::once(ours).chain(peers);
    let best = answers().map(|a| a.cost).fold(f64::INFINITY, f64::min);
    let title = format!("{name}: solver");
    let mut table =
        Table::new(&[&title, "wall [ms]", "CPU [ms]", "evaluations", "to armcal", "cost above the lowest"]);
    for a in answers() {
        let excess = a.cost / best - 1.0;
        table.row([
            a.who.clone(),
            format!("{:.3}", a.spent.wall_s * 1e3),
            format!("{:.3}", a.spent.cpu_s * 1e3),
            a.evaluations.to_string(),
            format!("{:.1}", a.spent.wall_s / ours.spent.wall_s),
            format!("{excess:.1e}"),
        ]);
    }
    section.table(table);
    let far: Vec<&str> =
        answers().filter(|a| a.cost > best * (1.0 + a.same_cost)).map(|a| a.who.as_str()).collect();
    if !far.is_empty() {
        return Err(format!("{name}: {} did not find the optimum\n{}", far.join(", "), section.text()).into());
    }
    section.bar(Bar {
        what: format!("fit, {name}, one core"),
        limit: "< 5 ms".into(),
        measured: format!("{:.2} ms", ours.spent.wall_s * 1e3),
        met: ours.spent.wall_s < 5e-3,
    });
    for peer in peers.iter().filter(|p| p.who.starts_with("scipy")) {
        let ratio = peer.spent.wall_s / ours.spent.wall_s;
        let bar = Bar {
            what: format!("fit, {name}, faster than {}", peer.who),
            limit: ">= 50".into(),
            measured: format!("{ratio:.0}"),
            met: ratio >= 50.0,
        };
        section.bar_of(bar, || {
            let each_us = peer.spent.wall_s * 1e6 / 50.0 / ours.evaluations as f64;
            format!(
                "it leaves {each_us:.0} us for each of armcal's {} evaluations of all dwells, with all that is solved and told after \
                 them",
                ours.evaluations
            )
        });
    }
    Ok(())
}
