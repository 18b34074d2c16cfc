//! The NC language. In: the bytes of a program. Out: a [`Program`] (blocks and words with byte spans) and a [`Toolpath`]
//! (what the machine does, in mm, s, rad). Nothing here fails: text that is not understood is kept as it is and diagnosed, and the feeds of
//! its block are frozen.
//!
//! | what | files |
//! |---|---|
//! | text: lines, tokens, numbers | [`program`], [`token`], `number`, the `lex.rs` of each family |
//! | values of expressions, and the variables in them | `expr`, `parameters` |
//! | which control and which unit | [`dialect`], [`recognise`], [`turning`] (programs for lathes), `refusal`, [`unit`] |
//! | what every control does with a block | `interp/` |
//! | what one family of dialects does its own way | `rs274/`, `siemens/`, `heidenhain/` |
//! | surroundings and results | [`environment`], `interpret`, [`toolpath`], [`doubt`], [`print`] |

pub mod dialect;
pub mod doubt;
pub mod environment;
mod expr;
mod heidenhain;
mod interp;
mod interpret;
mod number;
mod parameters;
pub mod print;
pub mod program;
pub mod recognise;
mod refusal;
mod rs274;
mod siemens;
pub mod token;
pub mod toolpath;
pub mod turning;
pub mod unit;

pub use dialect::{CommentForm, Dialect, Syntax};
pub use doubt::{Doubt, Doubted};
pub use environment::Environment;
pub use interpret::{has_flow_control, interpret, linked, plain_feeds, unroll};
pub use program::{BYTE_ORDER_MARK, File, MAX_TEXT, Part, Program, parse};
pub use refusal::refusal;
pub use rs274::acts_on_comment;
pub use siemens::is_setting;
pub use token::{Token, TokenKind};
pub use toolpath::{ADDITIONAL_OFFSETS, BEFORE_ADDITIONAL_OFFSETS};
pub use toolpath::{Event, FeedMode, FeedUse, Freeze, Move, MoveKind, PathMode, Spin, Toolpath};
