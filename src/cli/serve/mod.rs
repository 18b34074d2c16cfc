//! `serve`: the page of the programs of a folder, to a browser on this computer and nobody else. In: a folder. Out: an address with a
//! token, and pages until the process is ended.
//!
//! ```text
//! browser ─http─▶ head ─guard─▶ what is asked for ─answer─▶ page, file, refusal
//!                                    │  folder: programs, setups, what was dropped
//!                                    └─ kept: engagement in memory, so that other limits are solved without simulating
//! ```
//! Nothing is written: what is dropped stays in memory, and what is to be kept the browser saves.

mod address;
mod answer;
mod folder;
mod guard;
mod http;
mod kept;

use clap::Args;
use std::io::Read;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use super::error::CliError;
use super::options::Global;
use super::screen::{self, Screen};
use crate::report::Outcome;
use answer::Served;
use folder::{Folder, MOST_DROPPED};
use guard::Guard;
use http::{Answer, Head, Refused};

/// `serve`.
#[derive(Debug, Args)]
pub struct Serve {
    /// Folder of the programs and their setups.
    #[arg(default_value = ".")]
    pub folder: PathBuf,
    /// Port; a free one where nothing is said.
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    pub port: u16,
    /// Do not open the browser.
    #[arg(long)]
    pub no_open: bool,
}

/// Longest silence of a browser in the middle of a request.
const SILENCE: Duration = Duration::from_secs(10);
/// Longest wait for a browser that does not take its answer.
const SLOW: Duration = Duration::from_secs(60);
/// Most that is read of a refused request, bytes.
const UNREAD: u64 = 1 << 20;
/// Connections at a time: a browser opens six.
const MOST_AT_ONCE: usize = 24;

/// Serves until the process is ended.
pub fn serve(command: &Serve, global: &Global, screen: Screen) -> Result<Outcome, CliError> {
    let folder = Folder::open(&command.folder)?;
    let cannot = |error: std::io::Error| {
        CliError::new(format!("cannot listen on port {}: {error}", command.port), "leave --port out, or give another")
    };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, command.port)).map_err(cannot)?;
    let port = listener.local_addr().map_err(cannot)?.port();
    let guard = Guard::new(port)
        .map_err(|error| CliError::new(format!("the system gives no random numbers: {error}"), "try again"))?;
    let url = guard.url();
    screen::print(&format!("{url}\n"))?;
    screen.say(&format!("serves    {} to this computer alone; Ctrl-C ends it", folder.shown()));
    if !command.no_open {
        // A machine without a browser shows nothing; the address is printed all the same.
        let _ = open::that_detached(&url);
    }
    let served = Arc::new((guard, Served::new(folder, global.clone(), screen)));
    let at_once = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming().flatten() {
        let (served, at_once) = (Arc::clone(&served), Arc::clone(&at_once));
        if at_once.load(Ordering::Relaxed) >= MOST_AT_ONCE {
            continue;
        }
        let place = Place::taken(at_once);
        std::thread::spawn(move || {
            // A browser that went away is no fault.
            let _ = answer_one(stream, &served.0, &served.1);
            drop(place);
        });
    }
    Ok(Outcome::Done)
}

/// A place among the connections; free again when it is dropped, however its thread ends.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn taken(count: Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// One request and its answer.
fn answer_one(mut stream: TcpStream, guard: &Guard, served: &Served) -> std::io::Result<()> {
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(SLOW))?;
    let answered = Head::read(&mut stream).and_then(|mut head| match guard.admit(&head) {
        Err(refusal) => Ok(refusal),
        Ok(asked) => {
            let most = if asked.is_drop() { MOST_DROPPED } else { 0 };
            let body = head.body(&mut stream, most)?;
            Ok(served.answer(&head.method, &asked, body))
        }
    });
    let answer = match answered {
        Ok(answer) => answer,
        Err(Refused::With(status)) => Answer::refusal(status),
        Err(Refused::Gone) => return Ok(()),
    };
    answer.send(&mut stream)?;
    end(&mut stream)
}

/// Ends a connection. What of a refused request was not read is, a little of it: a system that is left with unread bytes takes back the
/// answer too.
fn end(stream: &mut TcpStream) -> std::io::Result<()> {
    stream.shutdown(Shutdown::Write)?;
    let mut left = stream.take(UNREAD);
    std::io::copy(&mut left, &mut std::io::sink()).map(drop)
}
