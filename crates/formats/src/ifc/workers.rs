//! Jobs on threads that can be abandoned: neither a panic nor an endless loop inside a library stops the import.
//!
//! A thread cannot be stopped from outside, only abandoned. So each worker owns its state and reports the start and the end of
//! each job; the caller's thread watches the clock and replaces a worker that exceeds its limit.
//!
//! Each worker is a rayon pool of one thread, so that parallel iterators inside the library stay on that thread and do not wait
//! for the global pool, which a caller inside that pool would block.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Once};
use std::time::{Duration, Instant};

/// Stack of a worker: deep boolean trees recurse. Only the touched part takes memory.
const STACK: usize = 64 << 20;

/// Work that is split into numbered jobs.
pub(super) trait Task: Send + Sync + 'static {
    /// Result of a job.
    type Output: Send + 'static;

    /// Number of jobs.
    fn jobs(&self) -> usize;

    /// Runs jobs from `next` until there are none, and passes each result to `done`. It is called again after a panic, so that
    /// damaged state is rebuilt.
    fn work(&self, next: &mut dyn FnMut() -> Option<usize>, done: &mut dyn FnMut(usize, Self::Output));
}

/// How a job ended.
#[derive(Debug, PartialEq)]
pub(super) enum Outcome<T> {
    /// With a result.
    Done(T),
    /// With a panic.
    Panicked,
    /// Not in time.
    TimedOut,
}

/// Time limits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// One job.
    pub(super) job: Duration,
    /// Deadline of all jobs.
    pub(super) deadline: Instant,
}

/// The jobs that ran when the deadline passed.
#[derive(Debug, PartialEq)]
pub(super) struct DeadlinePassed(pub(super) Vec<usize>);

enum Message<T> {
    Started { worker: usize, job: usize },
    Ended { worker: usize, job: usize, outcome: Outcome<T> },
}

struct Worker {
    running: Option<(usize, Instant)>,
    given_up: Arc<AtomicBool>,
    // Dropping a pool does not wait for its thread, which ends when the jobs run out.
    _pool: rayon::ThreadPool,
}

/// Runs all jobs on `threads` threads; results are in the order of jobs.
pub(super) fn run<T: Task>(
    task: &Arc<T>,
    threads: usize,
    limits: Limits,
) -> Result<Vec<Outcome<T::Output>>, DeadlinePassed> {
    let (sender, receiver) = channel();
    let counter = Arc::new(AtomicUsize::new(0));
    let mut outcomes: Vec<Option<Outcome<T::Output>>> = (0..task.jobs()).map(|_| None).collect();
    let mut workers: Vec<Worker> = Vec::new();
    for _ in 0..threads.clamp(1, task.jobs().max(1)) {
        workers.extend(spawn(task, workers.len(), &counter, &sender));
    }
    let mut open = task.jobs();
    while open > 0 {
        let now = Instant::now();
        if now >= limits.deadline || workers.is_empty() {
            let running = workers.iter().filter_map(|w| w.running.map(|(job, _)| job)).collect();
            workers.iter().for_each(|w| w.given_up.store(true, Ordering::Relaxed));
            return Err(DeadlinePassed(running));
        }
        let late = |w: &Worker| w.running.is_some_and(|(_, since)| now.duration_since(since) >= limits.job);
        if let Some(worker) = workers.iter_mut().find(|w| late(w)) {
            if let Some((job, _)) = worker.running.take() {
                outcomes[job] = Some(Outcome::TimedOut);
                open -= 1;
            }
            worker.given_up.store(true, Ordering::Relaxed);
            workers.extend(spawn(task, workers.len(), &counter, &sender));
            continue;
        }
        let wake = workers.iter().filter_map(|w| w.running).filter_map(|(_, since)| since.checked_add(limits.job)).min();
        let wake = wake.map_or(limits.deadline, |w| w.min(limits.deadline));
        match receiver.recv_timeout(wake.saturating_duration_since(now)).ok() {
            Some(Message::Started { worker, job }) if !workers[worker].given_up.load(Ordering::Relaxed) => {
                workers[worker].running = Some((job, Instant::now()));
            }
            Some(Message::Ended { worker, job, outcome }) if !workers[worker].given_up.load(Ordering::Relaxed) => {
                workers[worker].running = None;
                outcomes[job] = Some(outcome);
                open -= 1;
            }
            _ => {}
        }
    }
    // Every job has ended, so every slot is filled.
    Ok(outcomes.into_iter().map(|o| o.unwrap_or(Outcome::Panicked)).collect())
}

/// Runs one function as the only job.
pub(super) fn run_one<T: Send + 'static>(
    deadline: Instant,
    f: impl Fn() -> T + Send + Sync + 'static,
) -> Result<Outcome<T>, DeadlinePassed> {
    struct One<F>(F);
    impl<T: Send + 'static, F: Fn() -> T + Send + Sync + 'static> Task for One<F> {
        type Output = T;
        fn jobs(&self) -> usize {
            1
        }
        fn work(&self, next: &mut dyn FnMut() -> Option<usize>, done: &mut dyn FnMut(usize, T)) {
            while let Some(job) = next() {
                done(job, (self.0)());
            }
        }
    }
    let limits = Limits { job: Duration::MAX, deadline };
    Ok(run(&Arc::new(One(f)), 1, limits)?.pop().unwrap_or(Outcome::Panicked))
}

fn spawn<T: Task>(
    task: &Arc<T>,
    worker: usize,
    counter: &Arc<AtomicUsize>,
    sender: &Sender<Message<T::Output>>,
) -> Option<Worker> {
    quiet_panics();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .stack_size(STACK)
        .thread_name(move |_| format!("ifc-{worker}"))
        .build()
        .ok()?;
    let given_up = Arc::new(AtomicBool::new(false));
    let (task, counter, sender, stop) = (task.clone(), counter.clone(), sender.clone(), given_up.clone());
    pool.spawn(move || {
        QUIET.with(|q| q.set(true));
        let current = std::cell::Cell::new(None);
        let send = |message| {
            // Nobody receives after the deadline.
            let _ = sender.send(message);
        };
        let mut next = || {
            let job = counter
                .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| {
                    (n < task.jobs() && !stop.load(Ordering::Relaxed)).then_some(n + 1)
                })
                .ok()?;
            current.set(Some(job));
            send(Message::Started { worker, job });
            Some(job)
        };
        let mut done = |job, output| {
            current.set(None);
            send(Message::Ended { worker, job, outcome: Outcome::Done(output) });
        };
        while catch_unwind(AssertUnwindSafe(|| task.work(&mut next, &mut done))).is_err() {
            match current.take() {
                Some(job) => send(Message::Ended { worker, job, outcome: Outcome::Panicked }),
                None => break,
            }
        }
    });
    Some(Worker { running: None, given_up, _pool: pool })
}

thread_local! {
    static QUIET: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Silences panics of worker threads, which are caught and reported as notes; those of other threads go to the previous hook.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !QUIET.with(std::cell::Cell::get) {
                before(info);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Job 3 panics, job 5 never ends.
    struct Unruly;
    impl Task for Unruly {
        type Output = usize;
        fn jobs(&self) -> usize {
            9
        }
        fn work(&self, next: &mut dyn FnMut() -> Option<usize>, done: &mut dyn FnMut(usize, usize)) {
            while let Some(job) = next() {
                match job {
                    3 => panic!("job 3"),
                    5 => loop {
                        std::thread::park();
                    },
                    _ => done(job, job * job),
                }
            }
        }
    }

    #[test]
    fn a_panic_and_an_endless_job_cost_only_themselves() {
        let start = Instant::now();
        for threads in [1, 2, 7] {
            let limits = Limits { job: Duration::from_millis(150), deadline: Instant::now() + Duration::from_secs(60) };
            let outcomes = run(&Arc::new(Unruly), threads, limits).unwrap();
            for (job, outcome) in outcomes.into_iter().enumerate() {
                let expected = match job {
                    3 => Outcome::Panicked,
                    5 => Outcome::TimedOut,
                    _ => Outcome::Done(job * job),
                };
                assert_eq!(outcome, expected, "job {job} on {threads} threads");
            }
        }
        // Nobody waits for the endless job's thread.
        assert!(start.elapsed() < Duration::from_secs(30));
    }

    #[test]
    fn the_deadline_names_what_was_running() {
        let limits = Limits { job: Duration::from_secs(60), deadline: Instant::now() + Duration::from_millis(150) };
        assert_eq!(run(&Arc::new(Unruly), 1, limits), Err(DeadlinePassed(vec![5])));
        let deadline = Instant::now() + Duration::from_millis(50);
        let endless = || -> () {
            loop {
                std::thread::park();
            }
        };
        assert_eq!(run_one(deadline, endless), Err(DeadlinePassed(vec![0])));
    }
}
