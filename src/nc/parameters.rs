//! Parameters (variables) of a program, and how a control reads expressions of them. In: values as the program sets them, and what the control keeps
//! itself. Out: values by number and name, and which of them were read without ever having been set.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

/// Numbered and named parameters (variables) of a program.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    /// `#12`, `R12`, `Q12` by number.
    pub numbered: BTreeMap<u32, f64>,
    /// `#<name>` by name, lower case; those that begin with `_` are global, the others belong to a call.
    pub named: BTreeMap<(usize, String), f64>,
    /// Depth of calls.
    pub depth: usize,
    /// How expressions are read.
    pub(super) language: Language,
    /// Numbered parameters that were read without ever having been set, since [`Parameters::take_unset`].
    pub(super) unset: RefCell<Vec<u32>>,
    /// One that holds the feed in force was read, since [`Parameters::take_feed_read`].
    feed_read: Cell<bool>,
}

/// Whose expressions they are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Language {
    /// LinuxCNC and its kin.
    #[default]
    LinuxCnc,
    /// Macro B of Fanuc and Haas.
    MacroB,
    /// Siemens.
    Siemens,
    /// Plain language of Heidenhain.
    Heidenhain,
}

/// Variables of Macro B that hold the feed in force: of the block before, of the block being executed, of the interrupted one (Fanuc B-64304EN,
/// Custom macro, System variables: modal information).
const FEED_NUMBERS: [u32; 3] = [4109, 4309, 4509];
/// The one of LinuxCNC.
const FEED_NAME: &str = "_feed";

impl Parameters {
    /// None is set.
    pub fn new(language: Language) -> Self {
        Self { language, ..Self::default() }
    }
    pub(super) fn is_macro_b(&self) -> bool {
        self.language == Language::MacroB
    }
    /// Value of a numbered parameter; 0 when it was never set, NaN when only the control knows it.
    pub fn number(&self, index: u32) -> f64 {
        self.feed_read.set(self.feed_read.get() || self.is_macro_b() && FEED_NUMBERS.contains(&index));
        self.numbered.get(&index).copied().unwrap_or_else(|| {
            self.unset.borrow_mut().push(index);
            0.0
        })
    }
    /// Is a numbered parameter vacant: never set, in Macro B?
    pub(super) fn is_vacant(&self, index: u32) -> bool {
        self.is_macro_b() && !self.numbered.contains_key(&index)
    }
    /// Value of a numbered parameter that was set to one that is known.
    pub fn known(&self, index: u32) -> Option<f64> {
        self.numbered.get(&index).copied().filter(|value| !value.is_nan())
    }
    /// Numbered parameters that were read since the last call of this function although they were never set.
    pub fn take_unset(&self) -> Vec<u32> {
        self.unset.take()
    }
    /// Was one that holds the feed in force read since the last call of this function, by whatever number or spelling?
    pub fn take_feed_read(&self) -> bool {
        self.feed_read.take()
    }
    /// The number of a variable was worked out, before which so many variables without a value had been read. If there are more now, it may be
    /// any number, one that holds the feed in force too.
    pub(super) fn read_by_unknown_number(&self, unset_before: usize) {
        let unknown = self.is_macro_b() && self.unset.borrow().len() > unset_before;
        self.feed_read.set(self.feed_read.get() || unknown);
    }
    /// Sets those that hold the feed in force.
    pub fn set_feed(&mut self, feed: f64) {
        if self.is_macro_b() {
            self.numbered.extend(FEED_NUMBERS.map(|number| (number, feed)));
        }
        self.set_name(FEED_NAME, feed);
    }
    /// Value of a named parameter.
    pub fn name(&self, name: &str) -> Option<f64> {
        let key = self.key(name);
        self.feed_read.set(self.feed_read.get() || key.1 == FEED_NAME);
        self.named.get(&key).copied()
    }
    /// Sets a named parameter.
    pub fn set_name(&mut self, name: &str, value: f64) {
        self.named.insert(self.key(name), value);
    }
    fn key(&self, name: &str) -> (usize, String) {
        let name: String = name.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_ascii_lowercase();
        (if name.starts_with('_') { 0 } else { self.depth + 1 }, name)
    }
}

/// Index of QL0 and of QR0.
pub const LOCAL_Q: u32 = 10_000_000;
pub const LASTING_Q: u32 = 20_000_000;

/// Index of a parameter from what follows its letter: `5` of R5 and Q5; the local QL5 and the lasting QR5 have their own.
pub fn parameter_index(text: &str) -> Option<u32> {
    let (base, digits) = match text.as_bytes().first()? {
        b'L' | b'l' => (LOCAL_Q, &text[1..]),
        b'R' | b'r' => (LASTING_Q, &text[1..]),
        _ => (0, text),
    };
    digits.parse::<u32>().ok().and_then(|index| index.checked_add(base))
}

/// How the control names the parameter of this index, whose letter is R or Q: see [`parameter_index`].
pub fn local_name(letter: char, number: u32) -> String {
    match number {
        LASTING_Q.. => format!("{letter}R{}", number - LASTING_Q),
        LOCAL_Q.. => format!("{letter}L{}", number - LOCAL_Q),
        _ => format!("{letter}{number}"),
    }
}
