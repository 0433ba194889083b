//! Many lists stored in one array.

use rayon::prelude::*;

/// Lists per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 64;

/// Lists stored one after the other.
pub struct Lists<T> {
    /// `items[start[i]..start[i + 1]]` are list i.
    start: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default + Send + Sync> Lists<T> {
    /// Sorts items into `count` lists by the index given with each; the order within a list is preserved.
    pub fn new(count: usize, all: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut start = vec![0u32; count + 1];
        all.clone().for_each(|(list, _)| start[list as usize + 1] += 1);
        (0..count).for_each(|list| start[list + 1] += start[list]);
        let mut position = start.clone();
        let mut items = vec![T::default(); start[count] as usize];
        for (list, item) in all {
            let slot = &mut position[list as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Self { start, items }
    }

    /// One list with these items.
    pub fn one(items: Vec<T>) -> Self {
        Self { start: vec![0, items.len() as u32], items }
    }

    /// Number of lists.
    pub fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// The items of all lists.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The items of all lists, without the lists.
    pub fn into_items(self) -> Vec<T> {
        self.items
    }

    /// The items of a list.
    pub fn get(&self, list: usize) -> &[T] {
        &self.items[self.start[list] as usize..self.start[list + 1] as usize]
    }

    /// Calls `change` with each list, in parallel on the threads of the caller's pool.
    pub fn each_mut(&mut self, change: impl Fn(&mut [T]) + Sync) {
        let mut rest = self.items.as_mut_slice();
        let mut groups = Vec::with_capacity(self.start.len() / GRAIN + 1);
        for start in (0..self.start.len() - 1).step_by(GRAIN).map(|first| &self.start[first..]) {
            let start = &start[..start.len().min(GRAIN + 1)];
            let (group, after) = rest.split_at_mut((start[start.len() - 1] - start[0]) as usize);
            groups.push((start, group));
            rest = after;
        }
        let change_group = |(start, group): (&[u32], &mut [T])| {
            for ends in start.windows(2).filter(|ends| ends[0] < ends[1]) {
                change(&mut group[(ends[0] - start[0]) as usize..(ends[1] - start[0]) as usize]);
            }
        };
        if is_in_a_pool() {
            groups.into_par_iter().for_each(change_group);
        } else {
            groups.into_iter().for_each(change_group);
        }
    }

    /// Makes a new list from each non-empty one, in parallel as [`Lists::each_mut`]: `make` receives its index and items and appends the new ones.
    pub fn map<U: Copy + Send>(&self, make: impl Fn(usize, &[T], &mut Vec<U>) + Sync) -> Lists<U> {
        let part = |first: usize| {
            let last = (first + GRAIN).min(self.count());
            let (mut ends, mut items) = (Vec::with_capacity(last - first), Vec::new());
            for list in first..last {
                let own = self.get(list);
                if !own.is_empty() {
                    make(list, own, &mut items);
                }
                ends.push(items.len() as u32);
            }
            (ends, items)
        };
        let groups = 0..self.count().div_ceil(GRAIN);
        let parts: Vec<(Vec<u32>, Vec<U>)> = if is_in_a_pool() {
            groups.into_par_iter().map(|group| part(group * GRAIN)).collect()
        } else {
            groups.map(|group| part(group * GRAIN)).collect()
        };
        let mut start = Vec::with_capacity(self.start.len());
        start.push(0);
        let mut items = Vec::with_capacity(parts.iter().map(|(_, items)| items.len()).sum());
        for (ends, own) in parts {
            let before = items.len() as u32;
            start.extend(ends.iter().map(|end| before + end));
            items.extend(own);
        }
        Lists { start, items }
    }
}

/// Whether this thread belongs to a pool. Elsewhere rayon would start a global pool, whose threads outlive the library's contexts.
fn is_in_a_pool() -> bool {
    rayon::current_thread_index().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_keep_the_order_of_their_items() {
        let parts = [vec![(2, 1), (0, 2), (2, 3)], vec![], vec![(2, 4), (199, 5)]];
        let mut lists = Lists::new(200, parts.iter().flatten().copied());
        assert_eq!(
            (lists.get(0), lists.get(1), lists.get(2), lists.get(199)),
            (&[2][..], &[][..], &[1, 3, 4][..], &[5][..])
        );
        lists.each_mut(|list| list.reverse());
        assert_eq!((lists.get(2), lists.get(199), lists.count()), (&[4, 3, 1][..], &[5][..], 200));
        let twice = lists.map(|list, items, out| out.extend(items.iter().map(|item| list + item)));
        assert_eq!((twice.count(), twice.start[200], twice.start[3]), (200, 5, 4));
        assert_eq!(twice.items, [2, 6, 5, 3, 204]);
    }
}
