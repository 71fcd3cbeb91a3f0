//! What a pool comes to, and what to do next.

use super::PooledRun;
use crate::run::Status;
use crate::story::Story;
use crate::terminal::summarised;
use crate::text::{conclusion, millimetres, printable};
use crate::told_warning::ToldWarning;
use armcal_calibrate::{INADEQUATE, PairedDifference};

impl Story {
    /// Of a pool.
    pub fn of_pool(run: &PooledRun) -> Story {
        let names = run.recording_names();
        let warnings = run.all_warnings().into_iter().map(|w| ToldWarning::new(&names, None, w)).collect();
        let calibration = format!("{}{}", conclusion(&run.calibration), transfer(run));
        let known = summarised(&run.calibration).map(|said| format!("{said}."));
        Story::undiagnosed(calibration, known.into_iter().collect(), run.status(), next(run), warnings)
    }
}

/// What the calibration is worth on another day.
fn transfer(run: &PooledRun) -> String {
    let Some(transfer) = &run.transfer else { return String::new() };
    let side = &transfer.holdout;
    format!(
        " On recordings that it never saw it is {} mm (nominal {} mm).",
        millimetres(side.fitted.mean_m),
        millimetres(side.nominal.mean_m)
    )
}

fn next(run: &PooledRun) -> Vec<String> {
    let steps: Vec<String> = [effect(run), days(run)].into_iter().flatten().collect();
    if steps.is_empty() && run.status() == Status::Ok {
        return vec![
            "`armcal verify` judges it on a recording that the pool never saw; `armcal compensate` corrects set-points with it"
                .to_owned(),
        ];
    }
    steps
}

/// Where an effect is missing: what looks for it. An event between recordings does not show in one of them alone.
fn effect(run: &PooledRun) -> Option<String> {
    let times = run.calibration.left_over();
    let errors = run.errors();
    let mean_m = |at: &usize| errors[*at].calibrated.mean_m;
    let worst = (0..errors.len()).max_by(|a, b| mean_m(a).total_cmp(&mean_m(b)))?;
    (times.is_finite() && times > INADEQUATE).then(|| {
        format!(
            "errors are {times:.1} times the noise floor, most in `{}` ({} mm): `armcal diagnose` of a pipeline with that recording and \
             others looks for what is missing, and for what moved between them; pool again with it among the `[[effects]]`",
            printable(&run.recordings[worst].name),
            millimetres(errors[worst].calibrated.mean_m)
        )
    })
}

/// What an unseen day errs more is worth a word from this share of the floor on.
const WORTH_A_WORD: f64 = 0.1;

/// Where a day that the calibration never saw errs more by more than chance.
fn days(run: &PooledRun) -> Option<String> {
    let unseen = run.transfer.as_ref()?;
    let more = PairedDifference::between(&run.observations, &run.calibration, unseen)?;
    let [low, high] = more.ci95_m;
    let much = more.difference_m > WORTH_A_WORD * run.calibration.noise_floor_m;
    (low > 0.0 && high.is_finite() && much).then(|| {
        format!(
            "on a day that it never saw it errs {} mm more (95 % {} to {}): look for what changes from day to day, and give that to \
             each recording (`[pool] per_recording`), or pool more days",
            millimetres(more.difference_m),
            millimetres(low),
            millimetres(high)
        )
    })
}
