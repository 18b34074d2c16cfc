//! The family of RS274: ISO 6983 with the O words of LinuxCNC and the Macro B of Fanuc and Haas. In: blocks of its texts. Out:
//! their words, and the flow of the program.

mod calls;
mod comments;

pub use comments::acts as acts_on_comment;
mod flow;
pub(crate) mod lex;
pub(super) mod state;
mod unroll;
mod ways;

use state::Rs274;

use super::dialect::PERMANENT;
use super::doubt::Doubt;
use super::environment::Environment;
use super::interp::interpreter::{Family, Interpreter, Setting};
use super::interp::labels::{Labels, Way};
use super::interp::state::After;
use super::interp::unroll::{Executed, Plain, Record};
use super::interp::words::Words;
use super::program::Program;
use super::token::{Token, TokenKind};
use crate::diag::{Severity, Span};
use crate::ids::BlockId;

/// Letters of words that do something by themselves: all but the number of a block and of a routine.
const WORDS: &[u8] = b"ABCDEFHIJKLPQRSTUVWXYZ";
/// What a probing move found: G38 of LinuxCNC, G31 of Fanuc and Haas.
const PROBED: std::ops::RangeInclusive<u32> = 5061..=5070;

impl Family for Rs274 {
    fn new() -> Self {
        Self { repeats: Vec::new(), modal_macro: None }
    }

    fn end(run: &mut Interpreter<'_, Self>) {
        run.diagnose_blocks_not_executed();
        run.diagnose_mixed_points();
    }

    fn token(run: &mut Interpreter<'_, Self>, token: Token, text: &[u8], words: &mut Words) {
        match token.kind {
            // Behind IF … THEN it is executed with the condition.
            TokenKind::Assignment if words.beyond => {}
            TokenKind::Assignment => run.read_assignment(token, text),
            TokenKind::Expression if !words.beyond => words.bad.push((token.kind, token.span)),
            // A name amid words is none that steers.
            TokenKind::Name if !words.beyond && (!words.g.is_empty() || words.has_any(WORDS)) => {
                words.bad.push((token.kind, token.span));
            }
            _ => words.beyond = true,
        }
    }

    fn block(run: &mut Interpreter<'_, Self>, block: BlockId, words: &mut Words) -> After {
        let after = if words.beyond { run.flow_control(block) } else { After::Words };
        let command = || run.dialect().dollar_commands && run.flow.source.program().line_text(block).starts_with(b"$");
        if after == After::Words && command() { After::Command } else { after }
    }

    fn setting(run: &mut Interpreter<'_, Self>, code: u16, place: Span, words: &Words) -> Setting {
        match code {
            650 => {}
            660 | 661 => run.call_after_motions(words, code, place),
            670 => run.family.modal_macro = None,
            _ => return Setting::AsEverywhere,
        }
        Setting::Done
    }

    fn takes_all_words(run: &mut Interpreter<'_, Self>, words: &Words) -> bool {
        run.call_macro(words);
        words.has_g(650) || words.has_g(660)
    }

    fn calls_after_motions(run: &Interpreter<'_, Self>) -> bool {
        run.family.modal_macro.is_some() && !run.in_modal_macro()
    }

    fn called_after_motions(run: &Interpreter<'_, Self>) -> Option<String> {
        run.family.modal_macro.as_ref().and_then(|called| called.label.clone())
    }

    fn after_block(run: &mut Interpreter<'_, Self>, words: &Words) {
        run.call_words(words);
        run.call_modal_macro(words);
    }

    fn before_return(run: &mut Interpreter<'_, Self>, modal: bool) {
        let locals = run.locals();
        if let Some(called) = run.family.modal_macro.as_mut().filter(|_| modal) {
            called.arguments = locals;
        }
    }

    fn before_value(run: &mut Interpreter<'_, Self>, text: &[u8]) {
        run.predefine(text);
    }

    /// What a probing move found is a doubt of its own. #0 is vacant, and so are, in a call with arguments, those that were not
    /// given. From #500 on Macro B's variables outlast the program, so that only the control knows them.
    fn unset_variable(run: &mut Interpreter<'_, Self>, number: u32, place: Span) -> u32 {
        if PROBED.contains(&number) {
            run.doubt(Doubt::Probe, place);
        }
        if number == 0 || run.local_numbers().contains(&number) && run.has_own_locals() {
            return 0;
        }
        run.unknown_when_unrolled(place, number);
        if run.dialect().macro_b && number >= PERMANENT {
            run.parameters.numbered.insert(number, 0.0);
            let said = format!("#{number} is kept in the control and not known here: it is read as 0");
            let help = format!("if that matters, set it in the program: #{number} = …");
            run.not_understood("nc::control-variable", place, said, &help);
        }
        number
    }

    /// Stops, work offsets and tool offsets by their variables: #3006; #5201 to #5390 and #7001 to #7946, #14001 to #14386; #2001 to #2400, #10001 to
    /// #13999 (Fanuc B-64304EN, Custom macro, System variables; LinuxCNC, Numbered parameters: #5161 to #5390).
    fn sets_variable(run: &mut Interpreter<'_, Self>, number: u32) {
        let place = run.flow.source.program().span(run.block.id);
        let macro_b = run.dialect().macro_b;
        match number {
            3006 if macro_b => run.doubt(Doubt::ProgramStop, place),
            5161..=5390 => run.doubt(Doubt::ZeroShift, place),
            // External and work offsets as older controls number them (Fanuc B-63944EN, custom macro).
            2500..=2899 | 7001..=7946 | 14001..=14386 if macro_b => run.doubt(Doubt::ZeroShift, place),
            // Lengths by their H: wear and geometry; from 12001 on radii, of which it is not known whose they are.
            2001..=2400 if macro_b => run.length_is_written(Some((number - 2001) % 200 + 1)),
            10001..=11999 if macro_b => run.length_is_written(Some((number - 10001) % 1000 + 1)),
            12001..=13999 if macro_b => run.length_is_written(None),
            _ => {}
        }
    }

    fn ways(labels: &Labels, program: &Program, block: BlockId) -> Vec<Way> {
        ways::ways(labels, program, block)
    }

    /// `END m` and `WHILE … DO m` of Macro B.
    fn label(labels: &mut Labels, program: &Program, block: BlockId) {
        let mut name: &[u8] = b"";
        for token in program.tokens(block) {
            let bytes = token.span.of(program.text());
            let is = |word: &[u8]| name.eq_ignore_ascii_case(word);
            match token.kind {
                TokenKind::Name => name = bytes,
                TokenKind::Expression if is(b"DO") || is(b"END") => {
                    let number = super::number::decimal(bytes).map_or(0, |(value, _)| value as u32);
                    labels.loops.push((block.0, number, is(b"END")));
                }
                _ => {}
            }
        }
    }

    fn variable_name(number: u32) -> String {
        format!("#{number}")
    }

    fn acts_on(program: &Program, comment: &[u8]) -> bool {
        comments::acts(program.dialect(), comment)
    }

    fn obstacles(executed: &Executed<'_, Self>, record: &mut Record) {
        // G66.1 calls a macro after every block.
        if executed.program.tokens(executed.block).any(|t| t.kind == TokenKind::Word(b'G') && t.number == 66.1) {
            record.note_obstacle("a modal macro call", executed.program, executed.block, executed.main);
        }
    }

    fn head(record: &mut Record, line: &[u8]) {
        if line.starts_with(b"%") {
            record.text.extend_from_slice(line);
            (record.began, record.percent) = (true, true);
        }
    }

    fn foot(_program: &Program, record: &Record) -> Vec<u8> {
        if record.percent { b"%\n".to_vec() } else { Vec::new() }
    }

    fn plain(executed: &Executed<'_, Self>, token: &Token, record: &mut Record) -> Plain {
        unroll::plain(executed, token, record)
    }

    fn has_flow_control(program: &Program, _environment: &Environment<'_>) -> bool {
        let steers = |token: Token| match token.kind {
            TokenKind::Word(b'M') => [97.0, 98.0].contains(&token.number),
            TokenKind::Word(b'G') => [65.0, 66.0].contains(&token.number),
            TokenKind::Name | TokenKind::Routine | TokenKind::Assignment | TokenKind::Computed(_) => true,
            _ => false,
        };
        program.blocks().any(|block| program.tokens(block).any(steers))
    }
}

impl Interpreter<'_, Rs274> {
    /// Diagnoses the first coordinate without a decimal point in a text whose others have one, where the control may count increments without it:
    /// X60 is 0.060 mm then (Fanuc parameter 3401, DPI; Haas setting 162).
    fn diagnose_mixed_points(&mut self) {
        self.flow.source_id = 0;
        let program = self.program;
        if !self.dialect().counts_increments {
            return;
        }
        let coordinate =
            |token: &Token| matches!(token.kind, TokenKind::Word(b'X' | b'Y' | b'Z')) && token.number != 0.0;
        // A dwell counts milliseconds, arguments of a macro are its own.
        let is_other =
            |token: Token| token.kind == TokenKind::Word(b'G') && [4.0, 10.0, 65.0, 66.0].contains(&token.number);
        let blocks = program.blocks().take(program.own_len()).filter(|block| !program.tokens(*block).any(is_other));
        let mut all =
            blocks.flat_map(|block| program.tokens(block).filter(coordinate).map(move |token| (block, token)));
        let has_point = |token: &Token| token.span.of(program.text()).contains(&b'.');
        let Some((first, token)) = all.next() else { return };
        let other = all.find(|(_, other)| has_point(other) != has_point(&token));
        let without = if has_point(&token) { other } else { other.map(|_| (first, token)) };
        let Some((block, token)) = without else { return };
        self.block.id = block;
        let word = String::from_utf8_lossy(token.span.of(program.text())).into_owned();
        let text =
            format!("{word} has no decimal point, others have: read as {word}., on some controls it counts increments");
        let help = format!("write {word}. if it is that");
        self.say("nc::decimal-point", Severity::Warning, token.span, text, &help);
    }

    /// Diagnoses what cannot be read in blocks of the main text that were not executed (up to the closing `%`).
    fn diagnose_blocks_not_executed(&mut self) {
        self.flow.source_id = 0;
        let program = self.program;
        let executed = if self.flow.counts.is_empty() { self.flow.at.min(program.own_len()) } else { 0 };
        for block in program.blocks().take(program.own_len()).skip(executed) {
            if block.0 > 0 && program.line_text(block).starts_with(b"%") {
                break;
            }
            if self.flow.counts.get(block.ix()).is_some_and(|count| *count > 0) {
                continue;
            }
            self.block.id = block;
            let bad = program.tokens(block).filter(|t| matches!(t.kind, TokenKind::Bad | TokenKind::OpenComment));
            let bad: Vec<_> = bad.map(|token| (token.kind, token.span)).collect();
            self.diagnose_all_unreadable(&bad);
        }
    }
}
