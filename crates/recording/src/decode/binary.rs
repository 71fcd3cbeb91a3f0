//! Decoder of CDR (ROS 2) and ROS 1 messages: a program of skip and read steps, compiled once from the message
//! types in the file, runs over the bytes of each message.

use super::DecodeError;
use super::cursor::{Cursor, Delimiters};
use super::shapes::{Want, Wanted};
use super::sink::Sink;
use super::slot::Slot;
use super::types::{Kind, Number, Repeat, Types};

/// Messages nest at most this deep in a schema that is taken seriously.
const MAX_DEPTH: usize = 32;

/// Programs for the messages of one channel.
#[derive(Debug)]
pub(super) struct Code {
    encoding: Encoding,
    /// Whether `plain` goes to the end of a message, and nothing may be left over there.
    to_end: bool,
    /// For messages whose parts just follow one another: messages inside messages are flattened.
    plain: Programs,
    /// The same to the end of a message; `None` where something on the way has no known length.
    whole: Option<Programs>,
    /// For CDR2 that delimits each message.
    delimited: Programs,
}

#[derive(Debug)]
struct Programs {
    programs: Vec<Program>,
    main: usize,
}

/// A message inside another is flattened if skipping it takes at most this many steps.
const MAX_FLATTENED_STEPS: usize = 4;

/// The binary encodings of ROS.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// Aligned, with an encapsulation header.
    Cdr,
    /// Packed, little-endian.
    Ros1,
}

impl Encoding {
    /// What may follow a message, at most [bytes]: CDR is padded to a multiple of four by some middleware (DDSI-RTPS 2.5,
    /// 10.2.1.2).
    fn padding_bytes(self) -> usize {
        match self {
            Encoding::Cdr => 3,
            Encoding::Ros1 => 0,
        }
    }
}

/// Steps over one message type.
#[derive(Debug, Default)]
struct Program {
    steps: Vec<Step>,
    /// What a message of the type takes at least [bytes]; 0 only if it never takes any.
    min_bytes: usize,
    /// Levels of messages inside it, itself included.
    height: usize,
}

/// One field, or several alike that are skipped together.
#[derive(Debug, Clone, Copy)]
struct Step {
    what: What,
    repeat: Repeat,
    /// Where the value goes; `None` skips it.
    slot: Option<Slot>,
    /// How many steps from this one on read one number of its kind each, one behind the other.
    alike: usize,
}

#[derive(Debug, Clone, Copy)]
enum What {
    Number(Number),
    Text,
    /// Seconds of this layout, then nanoseconds.
    Time(Number),
    /// A message skipped by the program of this index.
    Skipped(usize),
    /// A message read by the program of this index.
    Read(usize),
}

impl Code {
    /// Compiles the steps that read `wanted` out of a message.
    pub(super) fn compile(types: &Types, wanted: &Wanted, encoding: Encoding) -> Result<Code, String> {
        let compile = |flatten, to_end: bool| {
            let skips = vec![Skip::Unknown; types.messages.len()];
            let mut compiler = Compiler { types, encoding, flatten, programs: Vec::new(), skips };
            let main = compiler.read(0, wanted, !to_end, 0)?;
            Ok::<_, String>(Programs { programs: compiler.programs, main })
        };
        let (plain, delimited) = (compile(true, false)?, compile(false, false)?);
        Ok(Code { encoding, to_end: false, plain, whole: compile(true, true).ok(), delimited })
    }

    /// Refuses messages that are longer or shorter than their definition from now on, as far as can be.
    pub(super) fn go_to_the_end(&mut self) {
        if let Some(whole) = self.whole.take() {
            (self.plain, self.to_end) = (whole, true);
        }
    }

    /// Runs over one message.
    pub(super) fn run<'m, S: Sink<'m>>(&self, data: &'m [u8], sink: &mut S) -> Result<(), DecodeError> {
        let cursor = match self.encoding {
            Encoding::Cdr => Cursor::cdr(data)?,
            Encoding::Ros1 => Cursor::ros1(data),
        };
        let code = match cursor.delimiters {
            Delimiters::ListsAndMessages => &self.delimited,
            Delimiters::None | Delimiters::Lists => &self.plain,
        };
        let mut machine = Machine { programs: &code.programs, cursor, sink };
        if machine.run(code.main).is_none() {
            return Err(machine.cursor.into_error());
        }
        let left = machine.cursor.rest().len();
        match self.to_end && left > self.encoding.padding_bytes() {
            true => Err(DecodeError::LeftOver { bytes: data.len(), left }),
            false => Ok(()),
        }
    }
}

struct Compiler<'a> {
    types: &'a Types,
    encoding: Encoding,
    /// Whether messages inside messages are flattened.
    flatten: bool,
    programs: Vec<Program>,
    /// The skipping program of each message type.
    skips: Vec<Skip>,
}

#[derive(Clone, Copy)]
enum Skip {
    Unknown,
    /// Being compiled: a type that is met again now contains itself.
    Open,
    Program(usize),
}

impl Compiler<'_> {
    /// Compiles the program that reads `wanted` out of a message type. `last`: nothing is read behind it, so that
    /// it may end with the last field read.
    fn read(&mut self, message: usize, wanted: &Wanted, last: bool, depth: usize) -> Result<usize, String> {
        let fields = &self.types.messages[message].fields;
        let end = match wanted.fields.last() {
            Some((index, _)) if last => index + 1,
            _ => fields.len(),
        };
        let mut steps = Vec::new();
        for (index, field) in fields[..end].iter().enumerate() {
            let want = wanted.fields.iter().find(|(i, _)| *i == index).map(|(_, want)| want);
            let step = match (want, field.kind) {
                (Some(Want::Inside(inside)), Kind::Message(inner)) => {
                    let last = last && index + 1 == end && field.repeat == Repeat::Once;
                    let program = self.read(inner, inside, last, depth + 1)?;
                    Step { what: What::Read(program), repeat: field.repeat, slot: None, alike: 0 }
                }
                (Some(Want::Value(slot)), kind) => {
                    self.step(kind, field.repeat, Some(*slot), &field.name, depth)?
                }
                (_, kind) => self.step(kind, field.repeat, None, &field.name, depth)?,
            };
            self.append(&mut steps, step);
        }
        self.add(steps)
    }

    /// The program that skips a message type.
    fn skip(&mut self, message: usize, depth: usize) -> Result<usize, String> {
        match self.skips[message] {
            Skip::Program(program) => return Ok(program),
            Skip::Open => return Err("a message type contains itself".to_owned()),
            Skip::Unknown if depth > MAX_DEPTH => return Err(too_deep()),
            Skip::Unknown => {}
        }
        self.skips[message] = Skip::Open;
        let mut steps = Vec::new();
        for field in &self.types.messages[message].fields {
            let step = self.step(field.kind, field.repeat, None, &field.name, depth)?;
            self.append(&mut steps, step);
        }
        let program = self.add(steps)?;
        self.skips[message] = Skip::Program(program);
        Ok(program)
    }

    fn step(
        &mut self,
        kind: Kind,
        repeat: Repeat,
        slot: Option<Slot>,
        field: &str,
        depth: usize,
    ) -> Result<Step, String> {
        let what = match kind {
            Kind::Number(number) => What::Number(number),
            Kind::Text => What::Text,
            // ROS 1 counts seconds in a uint32, ROS 2 in an int32.
            Kind::Time if self.encoding == Encoding::Ros1 => What::Time(Number::Unsigned(4)),
            Kind::Time => What::Time(Number::Signed(4)),
            Kind::Message(inner) => What::Skipped(self.skip(inner, depth + 1)?),
            Kind::WideText | Kind::Other => {
                return Err(format!(
                    "field `{field}`, a wstring, stands before what is read and has no portable length"
                ));
            }
        };
        Ok(Step { what, repeat, slot, alike: 0 })
    }

    /// Appends a step, in its place those of the message it stands for, if there is one of it and it is flattened;
    /// joins numbers of the same size that are skipped one after another.
    fn append(&self, steps: &mut Vec<Step>, step: Step) {
        // ROS 1 knows messages without bytes. A schema of a few lines can nest billions of them, so they take no step.
        if self.encoding == Encoding::Ros1 && self.min_bytes(&step) == 0 {
            return;
        }
        match step.what {
            What::Read(program) if self.flatten && step.repeat == Repeat::Once => {
                self.append_all(steps, program);
            }
            What::Skipped(program)
                if self.flatten
                    && step.repeat == Repeat::Once
                    && self.programs[program].steps.len() <= MAX_FLATTENED_STEPS =>
            {
                self.append_all(steps, program);
            }
            _ => match (steps.last_mut(), skipped_numbers(&step)) {
                (Some(before), Some((size, more)))
                    if skipped_numbers(before).is_some_and(|(size_before, _)| size_before == size) =>
                {
                    let count = skipped_numbers(before).map_or(0, |(_, count)| count);
                    before.repeat = Repeat::Fixed(count.saturating_add(more));
                }
                _ => steps.push(step),
            },
        }
    }

    fn append_all(&self, steps: &mut Vec<Step>, program: usize) {
        for &step in &self.programs[program].steps {
            self.append(steps, step);
        }
    }

    fn add(&mut self, mut steps: Vec<Step>) -> Result<usize, String> {
        if steps.is_empty() && self.encoding == Encoding::Cdr {
            // rosidl gives a message without fields `uint8 structure_needs_at_least_one_member`.
            let what = What::Number(Number::Unsigned(1));
            steps.push(Step { what, repeat: Repeat::Once, slot: None, alike: 0 });
        }
        let mut behind = None;
        for step in steps.iter_mut().rev() {
            let number = number_read(step);
            let more = behind.filter(|(after, _)| number == Some(*after)).map_or(0, |(_, alike)| alike);
            step.alike = number.map_or(0, |_| more + 1);
            behind = number.map(|number| (number, step.alike));
        }
        let min_bytes = steps.iter().fold(0, |sum: usize, step| sum.saturating_add(self.min_bytes(step)));
        let inner = |step: &Step| match step.what {
            What::Skipped(program) | What::Read(program) => self.programs[program].height,
            _ => 0,
        };
        let height = 1 + steps.iter().map(inner).max().unwrap_or(0);
        if height > MAX_DEPTH {
            return Err(too_deep());
        }
        self.programs.push(Program { steps, min_bytes, height });
        Ok(self.programs.len() - 1)
    }

    /// What a step takes at least [bytes], padding not counted.
    fn min_bytes(&self, step: &Step) -> usize {
        match step.repeat {
            Repeat::Once => element_bytes(&self.programs, step.what),
            Repeat::Fixed(count) => element_bytes(&self.programs, step.what).saturating_mul(count),
            Repeat::Sequence => 4,
        }
    }
}

fn too_deep() -> String {
    format!("its messages nest deeper than {MAX_DEPTH} levels")
}

/// What one element takes at least [bytes].
fn element_bytes(programs: &[Program], what: What) -> usize {
    match what {
        What::Number(number) => number.bytes(),
        What::Text => 4,
        What::Time(_) => 8,
        What::Skipped(program) | What::Read(program) => programs[program].min_bytes,
    }
}

/// The kind of the one number that a step reads, if that is what it does.
fn number_read(step: &Step) -> Option<Number> {
    match (step.what, step.slot, step.repeat) {
        (What::Number(number), Some(_), Repeat::Once) => Some(number),
        _ => None,
    }
}

/// Size and number of the numbers a step skips, if that is what it does and they are always as many.
fn skipped_numbers(step: &Step) -> Option<(usize, usize)> {
    match (step.what, step.slot, step.repeat) {
        (What::Number(number), None, Repeat::Once) => Some((number.bytes(), 1)),
        (What::Number(number), None, Repeat::Fixed(count)) if count > 0 => Some((number.bytes(), count)),
        _ => None,
    }
}

struct Machine<'a, 'm, S> {
    programs: &'a [Program],
    cursor: Cursor<'m>,
    sink: &'a mut S,
}

impl<'m, S: Sink<'m>> Machine<'_, 'm, S> {
    fn run(&mut self, program: usize) -> Option<()> {
        let end = match self.cursor.delimiters {
            Delimiters::ListsAndMessages => Some(self.cursor.delimiter()?),
            Delimiters::None | Delimiters::Lists => None,
        };
        let programs = self.programs;
        let mut steps = &programs[program].steps[..];
        while let Some((step, rest)) = steps.split_first() {
            if step.alike > 1 && self.alike(&steps[..step.alike]) {
                steps = &steps[step.alike..];
                continue;
            }
            self.step(step)?;
            steps = rest;
        }
        match end {
            Some(end) => self.cursor.finish_at(end),
            None => Some(()),
        }
    }

    /// Reads numbers of one kind at once, if all of them are there; else none, so that the first one missing is named.
    #[inline]
    fn alike(&mut self, steps: &[Step]) -> bool {
        let Some(number) = number_read(&steps[0]) else { return false };
        let Machine { cursor, sink, .. } = self;
        let take = |k: usize, value| steps[k].slot.into_iter().for_each(|slot| sink.number(slot, value));
        cursor.each(number, steps.len(), take).is_some()
    }

    #[inline]
    fn step(&mut self, step: &Step) -> Option<()> {
        if step.repeat == Repeat::Once {
            return self.element(step, false);
        }
        if self.cursor.delimiters != Delimiters::None && !matches!(step.what, What::Number(_)) {
            // The delimiter ends a list that is skipped; one that is read ends by its own count.
            let end = self.cursor.delimiter()?;
            if step.slot.is_none() && !matches!(step.what, What::Read(_)) {
                return self.cursor.finish_at(end);
            }
        }
        if let (What::Text, Some(slot), Repeat::Sequence) = (step.what, step.slot, step.repeat) {
            return self.texts(slot);
        }
        let min_bytes = element_bytes(self.programs, step.what);
        let count = match step.repeat {
            Repeat::Sequence => self.cursor.count(min_bytes)?,
            Repeat::Fixed(count) => {
                self.cursor.check_room(count, min_bytes)?;
                count
            }
            Repeat::Once => 1,
        };
        match (step.what, step.slot) {
            (What::Number(number), None) => _ = self.cursor.skip_numbers(number.bytes(), count)?,
            (What::Number(number), Some(slot)) => {
                self.cursor.numbers(number, count, slot, self.sink)?;
            }
            // Elements without bytes are all skipped, or all read, at once.
            _ if min_bytes == 0 => {}
            _ => {
                for _ in 0..count {
                    self.element(step, true)?;
                }
            }
        }
        Some(())
    }

    /// A list of texts; most messages repeat that of the message before.
    fn texts(&mut self, slot: Slot) -> Option<()> {
        let rest = self.cursor.rest_at_u32();
        if let Some(bytes) = self.sink.repeated_texts(slot, rest) {
            return self.cursor.take(bytes).map(|_| ());
        }
        for _ in 0..self.cursor.count(4)? {
            let text = self.cursor.text()?;
            self.sink.text(slot, text);
        }
        let list = &rest[..rest.len() - self.cursor.rest().len()];
        self.sink.remember_texts(slot, list);
        Some(())
    }

    #[inline]
    fn element(&mut self, step: &Step, is_item: bool) -> Option<()> {
        match (step.what, step.slot) {
            (What::Number(number), None) => _ = self.cursor.skip_numbers(number.bytes(), 1)?,
            (What::Number(number), Some(slot)) => self.sink.number(slot, self.cursor.number(number)?),
            (What::Text, None) => _ = self.cursor.text()?,
            (What::Text, Some(slot)) => self.sink.text(slot, self.cursor.text()?),
            (What::Time(number), slot) => {
                let seconds = self.cursor.number(number)?;
                let nanoseconds = self.cursor.number(Number::Unsigned(4))?;
                if slot.is_some() {
                    self.sink.number(Slot::Seconds, seconds);
                    self.sink.number(Slot::Nanoseconds, nanoseconds);
                }
            }
            (What::Skipped(program), _) => self.run(program)?,
            (What::Read(program), _) if is_item => {
                self.sink.begin_item();
                self.run(program)?;
                self.sink.end_item();
            }
            (What::Read(program), _) => self.run(program)?,
        }
        Some(())
    }
}
