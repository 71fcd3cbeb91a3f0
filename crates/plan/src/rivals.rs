//! Which explanations are to be told apart.

use armcal_diagnose::{Diagnosis, ParameterReport, UnknownReport, Verdict};
use armcal_model::{EffectSpec, Family};
use armcal_stages::RunError;

/// Effects that a quiet diagnosis leaves untested, at most this many.
const UNTESTED: usize = 24;

/// One explanation.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    /// The effect.
    pub spec: EffectSpec,
    /// Amplitudes that the data ask for, in typical sizes, by quantity; the others are taken at typical size.
    pub sizes: Vec<(String, f64)>,
}

/// The explanations that stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    /// Effects, the most probable first.
    pub rivals: Vec<Rival>,
    /// Whether "nothing" is one of the explanations.
    pub nothing: bool,
    /// Effects that are beyond doubt and belong in the model.
    pub certain: Vec<EffectSpec>,
    /// Why these.
    pub why: String,
}

/// What a diagnosis leaves standing: the first ambiguous set; the unlisted shape against the best names; otherwise the
/// effects that could not be tested, against nothing.
pub fn rivals_from_diagnosis(diagnosis: &Diagnosis, joints: &[String]) -> Result<Standing, RunError> {
    let parse = |name: &String| EffectSpec::parse(name, joints).map_err(RunError::Model);
    let open = diagnosis.effects.iter().position(|e| e.set.len() > 1);
    let mut certain = Vec::new();
    for (_, found) in diagnosis.effects.iter().enumerate().filter(|(i, _)| Some(*i) != open) {
        certain.push(parse(&found.name)?);
    }
    if let Some(found) = open.and_then(|i| diagnosis.effects.get(i)) {
        let mut rivals =
            found.set.iter().map(|n| parse_rival(diagnosis, n, joints)).collect::<Result<Vec<_>, _>>()?;
        for rival in rivals.iter_mut().filter(|r| r.spec.to_string() == found.name) {
            rival.sizes = relative_amplitudes(&found.parameters);
        }
        let why = "the diagnosis leaves more than one name for what it found".to_owned();
        return Ok(Standing { rivals, nothing: false, certain, why });
    }
    if diagnosis.verdict == Verdict::Unknown
        && let Some(spec) = diagnosis.unknown.as_ref().and_then(UnknownReport::effect)
    {
        let mut rivals = vec![Rival { spec, sizes: Vec::new() }];
        for candidate in diagnosis.candidates.iter().filter(|c| !c.spec.contains('+')).take(3) {
            rivals.push(parse_rival(diagnosis, &candidate.spec, joints)?);
        }
        let why =
            "the diagnosis found something unlisted; the listed effects that come nearest are its rivals";
        return Ok(Standing { rivals, nothing: false, certain, why: why.to_owned() });
    }
    let rivals = untested_rivals(diagnosis, joints)?;
    let why = "these data could not have shown these effects at a typical size".to_owned();
    Ok(Standing { rivals, nothing: true, certain, why })
}

/// The explanations a user names; one alone is told from nothing.
pub fn rivals_from_names(
    words: &[String],
    diagnosis: Option<&Diagnosis>,
    joints: &[String],
) -> Result<Standing, RunError> {
    let one = |word: &String| match diagnosis {
        Some(diagnosis) => parse_rival(diagnosis, word, joints),
        None => Ok(Rival { spec: EffectSpec::parse(word, joints)?, sizes: Vec::new() }),
    };
    let rivals = words.iter().map(one).collect::<Result<Vec<_>, RunError>>()?;
    let nothing = rivals.len() == 1;
    Ok(Standing { rivals, nothing, certain: Vec::new(), why: "you named them".to_owned() })
}

/// The effects that could not be tested and that depend on pose, direction or load, the most probable first. Events and
/// drifts are no matter of where the arm goes.
fn untested_rivals(diagnosis: &Diagnosis, joints: &[String]) -> Result<Vec<Rival>, RunError> {
    let rank = |name: &str| diagnosis.candidates.iter().position(|c| c.spec == name).unwrap_or(usize::MAX);
    let mut names: Vec<&String> = diagnosis.not_testable.iter().map(|n| &n.effect).collect();
    names.sort_by_key(|name| rank(name));
    let mut rivals: Vec<Rival> = Vec::new();
    for name in names {
        let rival = parse_rival(diagnosis, name, joints)?;
        let family = rival.spec.kind()?.family;
        if rivals.len() < UNTESTED && rival.spec.since.is_none() && family != Family::Drift {
            rivals.push(rival);
        }
    }
    Ok(rivals)
}

/// An effect at the size that the data ask for, where they ask for one.
fn parse_rival(diagnosis: &Diagnosis, name: &str, joints: &[String]) -> Result<Rival, RunError> {
    let spec = EffectSpec::parse(name, joints)?;
    let words = spec.to_string();
    let seen = diagnosis.candidates.iter().find(|c| c.spec == words);
    Ok(Rival { spec, sizes: seen.map(|c| relative_amplitudes(&c.parameters)).unwrap_or_default() })
}

fn relative_amplitudes(parameters: &[ParameterReport]) -> Vec<(String, f64)> {
    let clear = |p: &ParameterReport| p.ci95[0] > 0.0 || p.ci95[1] < 0.0;
    if !parameters.iter().any(clear) {
        return Vec::new();
    }
    parameters.iter().map(|p| (p.name.clone(), p.value / p.typical)).collect()
}
