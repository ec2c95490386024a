//! One function over a list, on several threads: for commands whose work is no [`crate::job::Job`].

use std::{
    num::NonZero,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

use crate::calib::{Error, Result};

/// Threads as asked for, or one for each processor.
pub fn threads(asked: Option<u16>) -> usize {
    let all = || thread::available_parallelism().map_or(1, NonZero::get);
    asked.map_or_else(all, usize::from).max(1)
}

/// `work` on every item, by `threads` threads that each take the next item when they are free: as many items as there are
/// threads are in memory. Results are in the order of the items; a panic becomes [`Error::Crashed`] of its item alone. `heard`
/// gets the number of items that are done.
pub fn side_by_side<T: Sync, R: Send>(
    threads: usize,
    items: &[T],
    work: impl Fn(&T) -> Result<R> + Sync,
    heard: &mut dyn FnMut(usize),
) -> Vec<Result<R>> {
    let next = AtomicUsize::new(0);
    let (sender, results) = mpsc::channel();
    let mut list: Vec<Result<R>> = items.iter().map(|_| Err(Error::Stopped)).collect();
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                while let Some((i, item)) = {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    items.get(i).map(|item| (i, item))
                } {
                    let done = catch_unwind(AssertUnwindSafe(|| work(item)));
                    let result =
                        done.unwrap_or_else(|panic| Err(Error::Crashed(crate::job::message(panic.as_ref()))));
                    if sender.send((i, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        for (done, (i, result)) in results.iter().enumerate() {
            list[i] = result;
            heard(done + 1);
        }
    });
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order_and_a_panic_costs_one() {
        let items: Vec<u32> = (0..100).collect();
        for threads in [1, 3, 200] {
            let mut most = 0;
            let work = |i: &u32| match i {
                7 => panic!("seven"),
                8 => Err(Error::Invalid("eight".into())),
                i => Ok(i * 2),
            };
            let list = side_by_side(threads, &items, work, &mut |done| most = most.max(done));
            assert_eq!((list.len(), most), (100, 100));
            assert_eq!(list[99], Ok(198));
            assert_eq!(list[7], Err(Error::Crashed("seven".into())));
            assert_eq!(list[8], Err(Error::Invalid("eight".into())));
        }
        assert!(side_by_side(4, &[] as &[u32], |i| Ok(*i), &mut |_| {}).is_empty());
    }
}
