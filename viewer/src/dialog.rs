//! The system's dialog to choose a file in. It has a thread of its own, so that frames go on.

use log::{Level, LevelFilter, Log, Metadata, Record};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Mutex, PoisonError};

/// Where there is neither a portal nor `zenity`; what to do instead.
const NONE: &str = "no file dialog: it needs a desktop portal or zenity; drop a file on the window instead";
/// The last program that is tried on Linux, in what the dialog's crate logs when it can't be run.
const LAST: &str = "zenity:";

/// Extensions of what can be opened in this build.
pub fn kinds() -> impl Iterator<Item = &'static str> {
    std::iter::once("pvs").chain(enfilade_formats::extensions())
}

/// A dialog that is open.
pub struct Dialog {
    answer: Receiver<Result<Option<PathBuf>, String>>,
}

impl Dialog {
    /// Opens it, from the thread of the window.
    pub fn open() -> Self {
        Failure::listen();
        let kinds: Vec<&str> = kinds().collect();
        let dialog = rfd::AsyncFileDialog::new().set_title("Open a building").add_filter("Buildings", &kinds);
        let dialog = dialog.add_filter("All files", &["*"]).pick_file();
        let (tell, answer) = channel();
        std::thread::spawn(move || {
            let file = pollster::block_on(dialog).map(|file| file.path().to_owned());
            // The window may be shut by now.
            let _ = tell.send(match file {
                None if FAILURE.take() => Err(NONE.to_owned()),
                file => Ok(file),
            });
        });
        Self { answer }
    }

    /// The file that was chosen, `None` for none; or why no dialog came, in a line. Nothing while it is open.
    pub fn answer(&self) -> Option<Result<Option<PathBuf>, String>> {
        match self.answer.try_recv() {
            Ok(answer) => Some(answer),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the file dialog failed".to_owned())),
        }
    }
}

/// Hears that no dialog came: the crate tells that to the log only.
struct Failure(Mutex<bool>);

static FAILURE: Failure = Failure(Mutex::new(false));

impl Failure {
    fn listen() {
        FAILURE.take();
        // The first dialog of a run sets it; a logger that is set already stays.
        if log::set_logger(&FAILURE).is_ok() {
            log::set_max_level(LevelFilter::Error);
        }
    }

    fn take(&self) -> bool {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Log for Failure {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() == Level::Error && metadata.target().starts_with("rfd")
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) && record.args().to_string().contains(LAST) {
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = true;
        }
    }

    fn flush(&self) {}
}
