//! Plants effects on a small arm and counts what the diagnosis makes of them.
//!
//! `cargo run --release -p armcal-diagnose --example sealed -- <null|catalogue|outside|pairs|time> [seeds] [free poses]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example tells its numbers")]

#[path = "../tests/arm/mod.rs"]
mod arm;

use arm::{LinearRefit, Noise, catalogue, design, outside, problem, rng};
use armcal_diagnose::{Diagnosis, DiagnosisConfig, Verdict, diagnose_problem};
use std::time::Instant;

fn run(p: armcal_diagnose::Problem) -> Diagnosis {
    diagnose_problem(&mut LinearRefit::new(p), &DiagnosisConfig::default()).unwrap()
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let what = args.get(1).map_or("time", String::as_str);
    let seeds: u64 = args.get(2).and_then(|s| s.parse().ok()).unwrap_or(10);
    let free: usize = args.get(3).and_then(|s| s.parse().ok()).unwrap_or(0);
    let start = Instant::now();
    match what {
        "null" => {
            for noise in [Noise::White, Noise::StudentT3, Noise::Ar1, Noise::Seat, Noise::Swaps] {
                let mut count = [0; 4];
                for seed in 0..seeds {
                    let mut r = rng(seed);
                    let poses = design(free, &mut r);
                    let d = run(problem(&poses, &[], noise, &mut r, true));
                    count[d.verdict as usize] += 1;
                    if d.verdict != Verdict::NothingMissing {
                        let u = d.unknown.as_ref().map(|u| format!("{} <- {}", u.channel, u.driver));
                        println!(
                            "  {noise:?} {seed}: {:?} {:?} {u:?} p0 {:.4}",
                            d.verdict, d.names, d.p_nothing
                        );
                    }
                }
                println!(
                    "{noise:?}: nothing {} identified {} ambiguous {} unknown {}",
                    count[0], count[1], count[2], count[3]
                );
            }
        }
        "catalogue" => {
            let poses = design(free, &mut rng(1));
            for k in 0..catalogue(&poses).len() {
                let (mut count, mut first, mut inset) = ([0; 4], 0, 0);
                let (mut spec, mut wrong) = (String::new(), Vec::new());
                let mut held = (0.0, 0.0);
                for seed in 0..seeds {
                    let mut r = rng(1000 * k as u64 + seed);
                    let poses = design(free, &mut r);
                    let listed = &catalogue(&poses)[k];
                    spec = listed.spec.clone();
                    let size = if seed % 2 == 0 { 1.0 } else { -0.6 };
                    let a = listed.typical.iter().map(|t| t * size).collect();
                    let d = run(problem(&poses, &[(listed.effect.clone(), a)], Noise::White, &mut r, true));
                    count[d.verdict as usize] += 1;
                    first += usize::from(d.effects.first().is_some_and(|e| e.name == spec));
                    let all = d.effects.iter().any(|e| e.set.contains(&spec));
                    inset += usize::from(all);
                    held = (held.0 + d.holdout_mm.before, held.1 + d.holdout_mm.after);
                    if d.verdict != Verdict::NothingMissing && !all {
                        let u = d.unknown.as_ref().map(|u| format!("{} <- {}", u.channel, u.driver));
                        wrong.push(format!(
                            "{:?} {u:?}",
                            d.effects.iter().map(|e| &e.set).collect::<Vec<_>>()
                        ));
                    }
                }
                let n = seeds as f64;
                println!(
                    "{spec}: nothing {} identified {} ambiguous {} unknown {} | first {first} in set {inset} | held out {:.2} -> {:.2} {wrong:?}",
                    count[0],
                    count[1],
                    count[2],
                    count[3],
                    held.0 / n,
                    held.1 / n
                );
            }
        }
        "outside" => {
            for (k, (name, channel, driver, effect)) in outside(1.0).into_iter().enumerate() {
                let (mut count, mut right, mut removed) = ([0; 4], 0, 0.0);
                let mut said = Vec::new();
                for seed in 0..seeds {
                    let mut r = rng(500 + 100 * k as u64 + seed);
                    let poses = design(free, &mut r);
                    let d = run(problem(&poses, &[(effect.clone(), vec![])], Noise::White, &mut r, true));
                    count[d.verdict as usize] += 1;
                    let u = d.unknown.as_ref();
                    let at = u.map(|u| (&u.channel, u.driver));
                    right += usize::from(at == Some((&channel, driver)));
                    if let Some(u) = u {
                        removed += u.expression.as_ref().map_or(0.0, |e| e.share_of_shape) / seeds as f64;
                        if seed == 0 {
                            println!(
                                "   {:?}",
                                u.expression.as_ref().map(|e| (&e.formula, e.share_of_shape))
                            );
                        }
                    }
                    if at != Some((&channel, driver)) || d.verdict != Verdict::Unknown {
                        said.push(format!(
                            "{:?} {:?} {at:?}",
                            d.verdict,
                            d.effects.iter().map(|e| &e.set).collect::<Vec<_>>()
                        ));
                    }
                }
                println!(
                    "{name}: nothing {} identified {} ambiguous {} unknown {} | place right {right} | expression keeps {removed:.2} {said:?}",
                    count[0], count[1], count[2], count[3]
                );
            }
        }
        "show" => {
            // sealed show <seed> <free> <noise|spec[+spec]>
            let name = args.get(4).cloned().unwrap_or_default();
            let mut r = rng(seeds);
            let poses = design(free, &mut r);
            let list = catalogue(&poses);
            let planted: Vec<_> = list
                .iter()
                .filter(|l| name.split('+').any(|n| n == l.spec))
                .map(|l| (l.effect.clone(), l.typical.clone()))
                .collect();
            let noise = match name.as_str() {
                "ar" => Noise::Ar1,
                "seat" => Noise::Seat,
                "t3" => Noise::StudentT3,
                "swaps" => Noise::Swaps,
                _ => Noise::White,
            };
            let d = run(problem(&poses, &planted, noise, &mut r, true));
            println!(
                "{:?} {:?} p0 {:e} noise {:?} aside {}",
                d.verdict,
                d.names,
                d.p_nothing,
                d.noise,
                d.set_aside.len()
            );
            for c in d.candidates.iter().take(6) {
                println!(
                    "  {} {} p {:.3} {:?} absorbed {:.3} smallest {:.2} {:?}",
                    c.spec,
                    c.standing.map_or(String::new(), |s| format!(
                        "behind {:.1} +- {:.1} P {:.4}",
                        s.behind_nats, s.behind_se, s.probability
                    )),
                    c.p_adjusted,
                    c.holdout_mm,
                    c.absorbed,
                    c.smallest_seen,
                    c.same_to_the_data
                );
            }
            if let Some(u) = &d.unknown {
                println!(
                    "  unknown {} <- {} gain {:.1} P {:.4} {:?} {:?}",
                    u.channel, u.driver, u.gain_nats, u.probability, u.expression, u.rivals
                );
            }
            for e in &d.effects {
                println!(
                    "  {:?} P {:.3} gain {:.1} +- {:.1} {:?}",
                    e.set, e.probability, e.gain_nats, e.gain_se, e.contrast
                );
            }
            println!("  {:?}", d.noise);
        }
        "robot" => {
            for seed in 0..seeds {
                let mut r = rng(70 + seed);
                let poses = design(free, &mut r);
                let names =
                    ["eccentricity:1", "eccentricity:2", "compliance:2", "backlash:3", "two_per_turn:3"];
                let list = catalogue(&poses);
                let mut planted: Vec<_> = names
                    .iter()
                    .filter_map(|n| list.iter().find(|l| l.spec == *n))
                    .map(|l| (l.effect.clone(), l.typical.clone()))
                    .collect();
                if seed % 2 == 1 {
                    planted.push((outside(1.0)[5].3.clone(), vec![]));
                }
                let p = problem(&poses, &planted, Noise::White, &mut r, true);
                let d = run(arm::overconfident(p, 20.0));
                println!("{:?} {:?}", d.verdict, d.effects.iter().map(|e| &e.set).collect::<Vec<_>>());
                println!(
                    "   {:?} {:?} sigma {:.1}",
                    d.unknown.as_ref().map(|u| (&u.channel, &u.driver)),
                    d.holdout_mm,
                    d.noise.sigma_ratio
                );
            }
        }
        "pairs" => {
            let poses = design(free, &mut rng(1));
            let names: Vec<String> = catalogue(&poses).iter().map(|l| l.spec.clone()).collect();
            let (mut both, mut one, mut wrong, mut total) = (0, 0, 0, 0);
            for seed in 0..seeds {
                let mut r = rng(9000 + seed);
                let poses = design(free, &mut r);
                let list = catalogue(&poses);
                let (i, j) = ((seed as usize * 7) % list.len(), (seed as usize * 13 + 5) % list.len());
                if i == j {
                    continue;
                }
                let plant = |k: usize| (list[k].effect.clone(), list[k].typical.clone());
                let d = run(problem(&poses, &[plant(i), plant(j)], Noise::White, &mut r, true));
                let found = |k: usize| d.effects.iter().any(|e| e.set.contains(&names[k]));
                let stray = d
                    .effects
                    .iter()
                    .filter(|e| !e.set.contains(&names[i]) && !e.set.contains(&names[j]))
                    .count();
                total += 1;
                both += usize::from(found(i) && found(j));
                one += usize::from(found(i) != found(j));
                wrong += usize::from(stray > 0);
                if !(found(i) && found(j)) {
                    println!(
                        "{} + {}: {:?} {:?}",
                        names[i],
                        names[j],
                        d.verdict,
                        d.effects.iter().map(|e| &e.set).collect::<Vec<_>>()
                    );
                }
            }
            println!("both {both} one {one} stray {wrong} of {total}");
        }
        _ => {
            let mut r = rng(1);
            let poses = design(free, &mut r);
            let list = catalogue(&poses);
            let plant = (list[0].effect.clone(), list[0].typical.clone());
            for (name, planted) in [("nothing", vec![]), ("one effect", vec![plant])] {
                let p = problem(&poses, &planted, Noise::White, &mut r, true);
                let t = Instant::now();
                let d = run(p);
                println!(
                    "{} dwells, {name}: {:.3} s, {:?} {:?}",
                    poses.len(),
                    t.elapsed().as_secs_f64(),
                    d.verdict,
                    d.names
                );
            }
        }
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
}
