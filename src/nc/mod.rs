//! The NC language. In: the bytes of a program. Out: a [`Program`] (blocks and words with byte spans) and a [`Toolpath`]
//! (what the machine does, in mm, s, rad). Nothing here fails: what is not understood is kept, diagnosed and frozen.

pub mod dialect;
pub mod doubt;
pub mod environment;
mod expr;
mod heidenhain_lex;
mod interp;
pub mod lex;
mod number;
pub mod print;
pub mod program;
pub mod recognise;
mod siemens_lex;
mod steer;
pub mod toolpath;
pub mod turning;
pub mod unit;

pub use dialect::{CommentForm, Dialect, Syntax};
pub use doubt::{Doubt, Doubted};
pub use environment::Environment;
pub use interp::{Expanded, expand, interpret, interpret_each, is_setting, linked, plain_feeds};
pub use lex::{Token, TokenKind};
pub use number::decimal;
pub use program::{File, MAX_TEXT, Part, Program, parse};
pub use steer::steers;
pub use toolpath::{Event, Feed, FeedMode, Freeze, Move, MoveKind, PathMode, Reached, Spin, State, Toolpath};
