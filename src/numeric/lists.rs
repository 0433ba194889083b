//! Lists that keep their memory while their contents are replaced.

/// Replaces the contents of a list by `len` copies of a value.
pub fn reset<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    list.clear();
    list.resize(len, value);
}

/// Replaces the contents of a list.
pub fn refill<T>(list: &mut Vec<T>, items: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(items);
}

/// Splits each list at an index, or at its end if it is shorter: lists of scalars that a liquid lacks are empty.
pub fn split_each<T, const N: usize>(lists: [&mut [T]; N], at: usize) -> [[&mut [T]; N]; 2] {
    let mut tails = [(); N].map(|()| Default::default());
    let mut slots = tails.iter_mut();
    let heads = lists.map(|list| {
        let (head, tail) = list.split_at_mut(at.min(list.len()));
        *slots.next().expect("one tail per list") = tail;
        head
    });
    [heads, tails]
}
