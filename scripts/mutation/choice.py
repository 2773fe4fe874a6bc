"""Which lines are broken, and the copy of the sources that holds every mutation asleep."""

import collections
import os
import random

ROOMS = ['base', 'rt', 'model', 'canopen', 'firmware_emu', 'hal', 'hal/config', 'hal/ethercat-can',
         'hal/sim', 'hal/remote', 'dds', 'controllers', 'log', 'report', 'runtime', 'scaffold', 'apps']
SPARE = 0.7  # so many more than are wanted, for those that do not compile

HEADER = '''#pragma once
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
namespace mutation {
inline unsigned char nowhere[%(size)d];
/// One byte for each mutation: whether anything came by it. Shared by all processes of a test.
inline unsigned char* reached = nowhere;
inline int woken = 0;
inline const bool ready = [] {
  if (const char* number = std::getenv("TANDEM_MUTANT")) woken = std::atoi(number);
  const char* path = std::getenv("TANDEM_MUTANT_MAP");
  const int file = path == nullptr ? -1 : ::open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return true;
  void* map = ::mmap(nullptr, %(size)d, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
  if (map != MAP_FAILED) reached = static_cast<unsigned char*>(map);
  ::close(file);
  return true;
}();
inline bool is(int number) noexcept {
  if (reached[number] == 0) reached[number] = 1;
  return number == woken;
}
}  // namespace mutation
'''


def room_of(path):
    fits = [room for room in ROOMS if path.startswith(room + '/')]
    return max(fits, key=len, default=None)


def choose(sources, count, seed):
    """So many and some spare ones of each room, its kinds and files in turn."""
    pools = collections.defaultdict(lambda: collections.defaultdict(list))
    generator = random.Random(seed)
    for path in sorted(sources):
        for one in sources[path].found:
            pools[room_of(path)][one['kind']].append(one)
    chosen, taken = [], collections.defaultdict(list)
    rooms = [room for room in ROOMS if pools[room]]
    share = -(-count // len(rooms))
    for room in rooms:
        for kind in sorted(pools[room]):
            generator.shuffle(pools[room][kind])
        wanted, kinds = round(share * (1 + SPARE)), sorted(pools[room])
        generator.shuffle(kinds)
        per_file, turn = collections.Counter(), 0
        while wanted and any(pools[room].values()):
            kind = kinds[turn % len(kinds)]
            turn += 1
            pool = pools[room][kind]
            # The file that has given least, as the pool's order has them.
            pool.sort(key=lambda one: per_file[one['file']])
            while pool:
                one = pool.pop(0)
                first, last = one['lines']
                if all(last < a or b < first for a, b in taken[one['file']]):
                    taken[one['file']].append((first, last))
                    per_file[one['file']] += 1
                    chosen.append(dict(one, room=room))
                    wanted -= 1
                    break
    # Numbered by rounds over the rooms, so that the first of each room are its mutations.
    by_room = collections.defaultdict(list)
    for one in chosen:
        by_room[one['room']].append(one)
    numbered = []
    while any(by_room.values()):
        for room in rooms:
            if by_room[room]:
                numbered.append(by_room[room].pop(0))
    return {n: one for n, one in enumerate(numbered, 1)}


def write_sources(copy, sources, mutants, dropped):
    """The copy's sources with all mutations but the dropped ones; untouched when nothing changes."""
    header = os.path.join(os.path.dirname(copy), 'mutation.hpp')
    for path, source in sources.items():
        edits = []
        for number, one in mutants.items():
            if one['file'] == path and number not in dropped:
                edits += one['make'](number)
        text = source.text
        for start, end, new in sorted(edits, reverse=True):
            new += '\n' * (text.count('\n', start, end) - new.count('\n'))
            text = text[:start] + new + text[end:]
        if edits:
            text = f'#include "{header}"\n#line 1\n{text}'
        write_changed(os.path.join(copy, path), text)


def write_changed(path, text):
    """Writes a file unless it is so already: what is untouched is not compiled again."""
    if os.path.exists(path):
        with open(path, encoding='utf-8') as file:
            if file.read() == text:
                return
    with open(path, 'w', encoding='utf-8') as file:
        file.write(text)
