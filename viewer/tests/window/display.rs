//! A display of its own for a test's window: Xvfb, xdotool's hands, xwd's eyes.

use crate::common::has_device;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long anything may take, seconds: the machine may be busy.
const PATIENCE: u64 = 90;

/// Ends with the test, whatever it comes to.
pub struct Ends(pub Child);

impl Drop for Ends {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until something is so.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(start.elapsed() < Duration::from_secs(PATIENCE), "no {what} after {PATIENCE} s");
        std::thread::sleep(Duration::from_millis(100));
    }
}

pub struct Display {
    /// As `DISPLAY` has it.
    pub name: String,
    _server: Ends,
}

impl Display {
    /// Starts a server, which picks a free display itself and names it once it can be reached.
    pub fn open() -> Self {
        // A server that its last client has left begins anew, and refuses who comes meanwhile: it must not.
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "800x600x24", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = Ends(server.expect("Xvfb starts"));
        let mut number = String::new();
        BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut number).expect("Xvfb names its display");
        assert!(number.trim().parse::<u32>().is_ok(), "Xvfb has no display: {number:?}");
        Self { name: format!(":{}", number.trim()), _server: server }
    }

    /// Runs a program on it. Returns what that wrote.
    pub fn run(&self, program: &str, args: &[&str]) -> Vec<u8> {
        let output = Command::new(program).args(args).env("DISPLAY", &self.name).output().expect(program);
        output.stdout
    }

    /// The first window with a title that fits.
    pub fn find(&self, title: &str) -> Option<String> {
        let found = self.run("xdotool", &["search", "--name", title]);
        String::from_utf8(found).ok()?.lines().next().map(str::to_owned).filter(|id| !id.is_empty())
    }

    /// The window's pixels: x, y, and its colour.
    pub fn pixels(&self, window: &str) -> Pixels {
        let dump = self.run("xwd", &["-silent", "-id", window]);
        Pixels::of(&dump)
    }
}

/// An X window dump of 32 bits a pixel.
pub struct Pixels {
    pub width: usize,
    pub colours: Vec<[u8; 3]>,
}

impl Pixels {
    /// Of a dump of `xwd`.
    pub fn of(dump: &[u8]) -> Self {
        let word = |i: usize| u32::from_be_bytes(dump[4 * i..4 * i + 4].try_into().unwrap()) as usize;
        let (header, width, height, row, colours) = (word(0), word(4), word(5), word(12), word(19));
        assert_eq!(word(11), 32, "bits a pixel");
        let start = header + 12 * colours;
        let at = |i: usize| start + i / width * row + 4 * (i % width);
        let pixel = |i: usize| [dump[at(i) + 2], dump[at(i) + 1], dump[at(i)]];
        Self { width, colours: (0..width * height).map(pixel).collect() }
    }

    /// How many are so.
    pub fn count(&self, is: impl Fn([u8; 3]) -> bool) -> usize {
        self.colours.iter().filter(|p| is(**p)).count()
    }

    /// The share that differs.
    pub fn differ(&self, other: &Self) -> f64 {
        assert_eq!((self.width, self.colours.len()), (other.width, other.colours.len()));
        let pairs = self.colours.iter().zip(&other.colours);
        pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 8)).count() as f64 / self.colours.len() as f64
    }
}

/// Whether everything is there; says by name what isn't.
pub fn can_run(test: &str) -> bool {
    let missing: Vec<&str> =
        ["Xvfb", "xdotool", "xwd"].into_iter().filter(|tool| Command::new(tool).arg("-version").output().is_err()).collect();
    if !missing.is_empty() {
        assert!(std::env::var_os("CI").is_none(), "{test}: no {missing:?}");
        eprintln!("not run: {test}: no {missing:?}");
        return false;
    }
    has_device()
}
