//! What was found, one entry each: with a name, without one.

use crate::drivers::{channel_told, driver_told};
use crate::explanations::nested_sentence;
use crate::sizes::{half_interval_ratio, size_in_table, sizes_of};
use armcal_calibrate::HeldOut;
use armcal_core::printable_name;
use armcal_diagnose::{DependsOn, Diagnosis, FoundEffect, UnknownReport, Verdict};
use armcal_model::{EffectKind, effects_toml, find};
use armcal_result::Called;

/// Amplitudes of an effect that are told where there is a line or two.
const FEW_SIZES: usize = 2;
/// Share of a curve [%] from which the multiples of a ripple are worth a word.
const BENT_PERCENT: f64 = 5.0;
/// What is less probable than this is not drawn as if it were there.
const IMPROBABLE: f64 = 0.05;

/// What was found: with names, without one, and what the choice among them is worth; one entry each.
pub fn all_found(called: &Called, d: &Diagnosis) -> Vec<String> {
    let nested = d.nested.iter().map(|n| printable_name(&nested_sentence(n)));
    let beside = d.beside_curves().iter().map(|e| format!("{WITH_CURVES}{}", named_effect_text(e)));
    let all = d
        .effects
        .iter()
        .map(named_effect_text)
        .chain(shown_unlisted(d).map(unlisted_text))
        .chain(beside)
        .chain(nested);
    all.map(|said| called.in_words(&said)).collect()
}

/// The same in a line or two each: names, sizes, and what they take of the error.
pub fn briefly_found(called: &Called, d: &Diagnosis) -> Vec<String> {
    let falls = |h: &HeldOut| format!("linearised from {:.3} to {:.3} mm", h.before, h.after);
    let sizes = |e: &FoundEffect| match e.parameters.len() {
        ..=FEW_SIZES => sizes_of(e),
        n if e.parameters.iter().all(|p| half_interval_ratio(p) < 1.0) => {
            format!("none of its {n} sizes is determined by itself")
        }
        _ => size_in_table(&e.parameters),
    };
    let named = d.effects.iter().map(|e| format!("{}: {}; {}", e.name, sizes(e), falls(&e.places)));
    let unlisted = shown_unlisted(d).map(|u| {
        format!(
            "unlisted, at {} over {}: {}",
            channel_told(&u.channel),
            driver_told(u.driver),
            falls(&u.places)
        )
    });
    let beside = d
        .beside_curves()
        .iter()
        .map(|e| format!("{WITH_CURVES}{}: {}", e.set.join(" or "), falls(&e.places)));
    named.chain(unlisted).chain(beside).map(|said| called.in_words(&printable_name(&said))).collect()
}

/// What is said before an effect that shows only beside error curves of joints.
pub const WITH_CURVES: &str = "with these curves in the model also ";

/// The kind of an effect that was found; none of something without a name.
pub fn kind_of(e: &FoundEffect) -> Option<&'static EffectKind> {
    e.name.split([':', '@', ',']).next().and_then(find)
}

/// A named effect: its sizes, what it takes of the error, what stands beside it.
pub fn named_effect_text(e: &FoundEffect) -> String {
    let set = if e.set.len() > 1 { format!(" (one of {})", e.set.join(", ")) } else { String::new() };
    let contrast = match &e.contrast {
        Some(c) if c.agrees => {
            format!("; {} pairs that differ only in {} confirm it", c.pairs, c.differs)
        }
        _ => String::new(),
    };
    let h = &e.places;
    let rival = e.rival.as_ref().map_or(String::new(), |r| {
        format!(
            "; the next listed explanation, {}, is {:.1} +- {:.1} nats behind and would leave {:.3} mm",
            r.name, r.behind_nats, r.behind_se, r.places.after
        )
    });
    printable_name(&format!(
        "{}{set}: {}; linearised, each place left out in turn: from {:.3} to {:.3} mm (change {:.3} to {:.3}, 95 \
         %){rival}{contrast}",
        e.name,
        sizes_of(e),
        h.before,
        h.after,
        h.change_ci95[0],
        h.change_ci95[1],
    ))
}

/// The `[[effects]]` table for something unlisted; empty where nothing offered reaches its shape.
pub fn unlisted_toml(u: &UnknownReport) -> String {
    u.effect().and_then(|effect| effects_toml(&[effect]).ok()).unwrap_or_default()
}

/// Something without a name: where it enters, over what, what it takes of the error, its shape.
pub fn unlisted_text(u: &UnknownReport) -> String {
    let range = match (u.shape.first(), u.shape.last()) {
        // An angle that counts with the direction of arrival is an angle.
        (Some(from), Some(to))
            if matches!(
                u.driver,
                DependsOn::Angle(_) | DependsOn::AngleSum(_) | DependsOn::AngleByDirection(_)
            ) =>
        {
            let deg = |at: f64| at.to_degrees();
            format!(", known for {} from {:.0} to {:.0} deg", u.driver, deg(from.at), deg(to.at))
        }
        (Some(from), Some(to)) => format!(", known for {} from {:.3} to {:.3}", u.driver, from.at, to.at),
        _ => String::new(),
    };
    let ripple = u.ripple.as_ref().map_or(String::new(), |r| {
        let (percent, amplitude) = (100.0 * r.share, u.unit.to_display(r.amplitude));
        let more = 100.0 * r.share_with_multiples - percent;
        let bent = if more >= BENT_PERCENT { format!(", {more:.0} % more with twice and three times that") } else { String::new() };
        format!(
            "; {percent:.0} % of it beside its slow part is a ripple of {:.1} periods a turn, amplitude {amplitude:.4} {}{bent}",
            r.periods_per_turn,
            u.unit.display_symbol()
        )
    });
    let formula = u
        .expression
        .as_ref()
        .map_or(String::new(), |e| format!("; as a formula on {}: {}", e.acts_on, e.formula));
    printable_name(&format!(
        "unlisted, at {} over {}: linearised, each place left out in turn: from {:.3} to {:.3} mm with \
         its shape{range}{ripple}{formula}",
        channel_told(&u.channel),
        driver_told(u.driver),
        u.places.before,
        u.places.after
    ))
}

/// What no name explains, as people are told it and shown it: where it is the answer, and unless that anything does not have a
/// name is improbable.
pub fn shown_unlisted(d: &Diagnosis) -> impl Iterator<Item = &UnknownReport> {
    d.unlisted.iter().filter(|u| d.verdict == Verdict::Unknown || u.probability >= IMPROBABLE)
}
