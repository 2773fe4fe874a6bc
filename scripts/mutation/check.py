"""The steps of a mutation check, as scripts/mutation-check describes them."""

import collections
import json
import math
import mmap
import os
import re
import shutil
import signal
import subprocess
import sys
import time

from mutation.choice import HEADER, ROOMS, choose, room_of, write_changed, write_sources
from mutation.source import Source

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NOT_RUN = {'architecture_test', 'hil_test'}


def usual_signals():
    """Of a test, also when this was started by nohup."""
    for one in (signal.SIGHUP, signal.SIGINT):
        signal.signal(one, signal.SIG_DFL)


class Check:
    def __init__(self, options):
        self.options = options
        self.folder = os.path.abspath(options.folder)
        self.copy = os.path.join(self.folder, 'tree')
        self.build = os.path.join(self.copy, 'build/release')
        self.stored = os.path.join(self.build, 'lib/models')
        self.pristine = os.path.join(self.folder, 'kernels')
        self.state_path = os.path.join(self.folder, 'state.json')
        self.state = {'dropped': [], 'reach': {}, 'results': {}}
        if os.path.exists(self.state_path):
            with open(self.state_path, encoding='utf-8') as file:
                self.state = json.load(file)
        key = {'count': options.count, 'seed': options.seed}
        if self.state.setdefault('key', key) != key:
            sys.exit(f'{self.folder} holds a run of {self.state["key"]}: choose another --folder, '
                     'or delete it')
        self.left_out = NOT_RUN | set(options.without.split(','))
        self.map_path = f'/dev/shm/tandem-mutants-{os.getpid()}'

    def save(self):
        with open(self.state_path + '.new', 'w', encoding='utf-8') as file:
            json.dump(self.state, file, indent=0)
        os.replace(self.state_path + '.new', self.state_path)

    # -------- 1: copy, choose, write

    def copy_tree(self, only=''):
        """What git tracks; the sources that are mutated come from `plain`, a second copy."""
        listed = subprocess.run(['git', 'ls-files', '-z', only or '.'], cwd=ROOT, check=True,
                                capture_output=True, text=True).stdout
        for path in filter(None, listed.split('\0')):
            source, target = os.path.join(ROOT, path), os.path.join(self.copy, path)
            if not os.path.exists(source) or os.path.isdir(source):
                continue
            os.makedirs(os.path.dirname(target), exist_ok=True)
            with open(source, 'rb') as file:
                data = file.read()
            if os.path.exists(target):
                with open(target, 'rb') as file:
                    if file.read() == data:
                        continue
            shutil.copy(source, target)
        for tests in ('tests/log', 'tests/dds'):
            modules = os.path.join(ROOT, tests, 'node_modules')
            if os.path.isdir(modules) and not os.path.lexists(os.path.join(self.copy, tests, 'node_modules')):
                os.symlink(modules, os.path.join(self.copy, tests, 'node_modules'))

    def prepare(self):
        plain = os.path.join(self.folder, 'plain.json')
        if not os.path.exists(plain):
            self.copy_tree()
            texts = {}
            listed = subprocess.run(['git', 'ls-files', '*.cpp', '*.hpp'], cwd=ROOT, check=True,
                                    capture_output=True, text=True).stdout.split()
            for path in listed:
                if room_of(path) and os.path.exists(os.path.join(ROOT, path)):
                    with open(os.path.join(ROOT, path), encoding='utf-8') as file:
                        texts[path] = file.read()
            with open(plain, 'w', encoding='utf-8') as file:
                json.dump(texts, file)
        with open(plain, encoding='utf-8') as file:
            self.sources = {path: Source(path, text) for path, text in json.load(file).items()}
        self.mutants = choose(self.sources, self.options.count, self.options.seed)
        write_changed(os.path.join(self.folder, 'mutation.hpp'), HEADER % {'size': len(self.mutants) + 1})

    # -------- 2: build

    def run_build(self, *targets):
        """Builds; True when it did, else drops what did not compile."""
        command = ['ninja', '-C', self.build,
                   f'-j{self.options.jobs}', *targets]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              errors='replace', check=False)
        with open(os.path.join(self.folder, 'build.txt'), 'a', encoding='utf-8') as file:
            file.write(done.stdout)
        if done.returncode == 0:
            return True
        at = collections.defaultdict(set)
        for number, one in self.mutants.items():
            if number not in self.state['dropped']:
                for line in range(one['lines'][0], one['lines'][1] + 1):
                    at[one['file'], line].add(number)
        guilty = set()
        for block in re.split(r'^(?=\S+:\d+:\d+: error: )', done.stdout, flags=re.M)[1:]:
            places = [at.get((os.path.relpath(os.path.normpath(os.path.join(self.build, path)),
                                              self.copy), int(line)), set())
                      for path, line in re.findall(r'^\s*(?:In file included from )?([^\s:]+\.[ch]pp):(\d+)',
                                                   block, re.M)]
            hit = next((numbers for numbers in places if numbers), set())
            guilty |= hit
        if not guilty:  # The place that is named before the error: 'required from here'.
            for path, line in re.findall(r'([^\s:]+\.[ch]pp):(\d+):\d+: ', done.stdout):
                guilty |= at.get((os.path.relpath(os.path.normpath(os.path.join(self.build, path)),
                                                  self.copy), int(line)), set())
        if not guilty:  # An object of a class that can no longer be constant: the nearest in its source.
            for path, line in re.findall(r'([^\s:]+\.[ch]pp):(\d+):\d+: error', done.stdout):
                path = os.path.relpath(os.path.normpath(os.path.join(self.build, path)), self.copy)
                near = [(abs(int(line) - l), min(numbers)) for (p, l), numbers in at.items() if p == path]
                guilty |= {min(near)[1]} if near else self.initial_values(path)
        if not guilty:
            sys.exit(f'the build failed, by no mutation: see {self.folder}/build.txt')
        self.state['dropped'] = sorted(set(self.state['dropped']) | guilty)
        print(f'  {len(guilty)} do not compile and drop out: {sorted(guilty)}', flush=True)
        self.save()
        return False

    def initial_values(self, path):
        """The mutations of members' initial values in what a source includes."""
        with open(os.path.join(self.copy, path), encoding='utf-8') as file:
            included = set(re.findall(r'^#include "([^"]+)"', file.read(), re.M))
        return {number for number, one in self.mutants.items()
                if one['scope'] == 'class' and one['file'] in included and number not in self.state['dropped']}

    def make(self):
        if not os.path.exists(os.path.join(self.build, 'build.ninja')):
            os.makedirs(self.pristine, exist_ok=True)
            if os.path.isdir(self.options.kernels):
                shutil.copytree(self.options.kernels, self.pristine, dirs_exist_ok=True)
            shutil.copytree(self.pristine, self.stored, dirs_exist_ok=True)
            subprocess.run(['cmake', '--preset', 'release', '--log-level=WARNING',
                            '-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG'], cwd=self.copy,
                           check=True, stdout=subprocess.DEVNULL)
        named = subprocess.run(['ninja', '-C', self.build, '-t', 'targets', 'all'], check=True,
                               capture_output=True, text=True).stdout
        tests = set(re.findall(r'^(\w+_test): phony', named, re.M)) - self.left_out
        for targets in (['tandem', 'bundled_controllers'], sorted(tests)):
            while True:
                write_sources(self.copy, self.sources, self.mutants, set(self.state['dropped']))
                print('building', 'the program' if 'tandem' in targets else 'its tests', flush=True)
                if self.run_build(*targets):
                    break
        shutil.copytree(self.stored, self.pristine, dirs_exist_ok=True)
        made = os.path.join(self.build, 'tests/model/kernels')
        shutil.copytree(made, self.pristine + '-of-model_test', dirs_exist_ok=True)

    # -------- running tests

    def restore(self):
        """What a mutated program may have spoilt."""
        for good, used in ((self.pristine, self.stored),
                           (self.pristine + '-of-model_test', os.path.join(self.build, 'tests/model/kernels'))):
            os.makedirs(used, exist_ok=True)
            for name in set(os.listdir(used)) - set(os.listdir(good)):
                path = os.path.join(used, name)
                shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)
            for name in os.listdir(good):
                a, b = os.path.join(good, name), os.path.join(used, name)
                if os.path.isdir(a):
                    continue
                if not os.path.exists(b) or os.stat(a).st_mtime_ns != os.stat(b).st_mtime_ns:
                    shutil.copy2(a, b)
        for folder in ('tmp', 'home'):
            shutil.rmtree(os.path.join(self.scratch, folder), ignore_errors=True)
            os.makedirs(os.path.join(self.scratch, folder))

    def run(self, mutant, arguments, limit):
        """(exit status or None when it hung, what it said); the map says what it came by."""
        with open(self.map_path, 'wb') as file:
            file.write(bytes(len(self.mutants) + 1))
        os.chmod(self.map_path, 0o666)
        environment = dict(os.environ, TANDEM_MUTANT=str(mutant), TANDEM_MUTANT_MAP=self.map_path,
                           TMPDIR=os.path.join(self.scratch, 'tmp'),
                           HOME=os.path.join(self.scratch, 'home'))
        environment.pop('XDG_CACHE_HOME', None)
        said = os.path.join(self.scratch, 'said')
        with open(said, 'wb') as out:
            process = subprocess.Popen(arguments, stdin=subprocess.DEVNULL,
                                       stdout=out, stderr=subprocess.STDOUT, cwd=self.scratch,
                                       env=environment, start_new_session=True,
                                       preexec_fn=usual_signals)
            try:
                status = process.wait(limit)
            except subprocess.TimeoutExpired:
                status = None
        self.end_children()
        process.wait()
        with open(said, encoding='utf-8', errors='replace') as file:
            text = file.read()
        return status, text

    @staticmethod
    def end_children():
        """Ends what a test left behind: this process inherits its orphans."""
        for _ in range(50):
            try:
                with open(f'/proc/self/task/{os.getpid()}/children', encoding='ascii') as file:
                    children = [int(child) for child in file.read().split()]
            except OSError:
                return
            for child in children:
                try:
                    os.kill(child, signal.SIGKILL)
                    os.waitpid(child, os.WNOHANG)
                except (ProcessLookupError, ChildProcessError):
                    pass
            if not children:
                return
            time.sleep(0.02)

    def reached(self):
        with open(self.map_path, 'rb') as file:
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                return [n for n, byte in enumerate(bytes(data)) if byte]

    # -------- 3: every case without a mutation

    def programs(self):
        folder = os.path.join(self.build, 'bin')
        return sorted(name for name in os.listdir(folder)
                      if name.endswith('_test') and name not in self.left_out)

    def cases(self, program):
        listed = subprocess.run([os.path.join(self.build, 'bin', program), '--gtest_list_tests'],
                                capture_output=True, text=True, check=True, cwd=self.scratch).stdout
        suite = ''
        for line in listed.splitlines():
            name = line.split('#')[0].rstrip()
            if not name.startswith(' '):
                suite = name
            elif not (suite + name.strip()).startswith('Running'):
                yield suite + name.strip()

    def gtest(self, mutant, program, cases, limit):
        everything = set(cases) == set(self.state['reach'].get(program, {}).get('cases', {}))
        return self.run(mutant, [os.path.join(self.build, 'bin', program), '--gtest_fail_fast',
                                 '--gtest_filter=' + ('*' if everything else ':'.join(cases))], limit)

    def reach(self):
        for program in self.programs():
            binary = os.stat(os.path.join(self.build, 'bin', program)).st_mtime
            known = self.state['reach'].setdefault(program, {'built': 0, 'cases': {}})
            if known['built'] == binary:
                continue
            listed = list(self.cases(program))
            print(f'{program}: {len(listed)} cases without a mutation', flush=True)
            old, known['cases'] = known['cases'], {}
            for case in listed:
                self.restore()
                for _ in range(2):
                    began = time.monotonic()
                    status, text = self.gtest(0, program, [case], 600)
                    if status == 0:
                        break
                known['cases'][case] = {'s': round(time.monotonic() - began, 3), 'passed': status == 0,
                                        'by': self.reached()}
                if status != 0:
                    print(f'  {case} fails without a mutation and is left out\n'
                          + '\n'.join('    ' + line for line in text.splitlines()[-12:]), flush=True)
            del old
            known['built'] = binary
            self.save()
        if 'kernels' not in self.state['reach']:
            made = self.make_kernels(0)
            self.state['reach']['kernels'] = {'built': 0, 'cases': {'made': {
                's': made[2], 'passed': made[0] == 0, 'by': made[1]}}}
            self.save()

    def make_kernels(self, mutant):
        """The generator's kernels of a reference robot, made anew: (status, what it came by, time)."""
        began = time.monotonic()
        library = os.path.join(self.build, 'tests/model/kernels/double_pendulum_kernels.so')
        if os.path.exists(library):
            os.remove(library)
        shutil.rmtree(library + '.build', ignore_errors=True)
        status, _ = self.run(mutant, [os.path.join(self.build, 'bin/model_make_kernels'),
                                      'double_pendulum', library], 300)
        return status, self.reached(), round(time.monotonic() - began, 3)

    # -------- 4: each mutation

    def selected(self):
        """The numbers that compile, so many as are wanted."""
        alive = [n for n, one in self.mutants.items()
                 if n not in self.state['dropped'] and not one['original'].startswith('assert(')]
        return alive[:self.options.count]

    def chunks(self, number):
        """[(program, cases, seconds)] that come by a mutation, in the order in which they are run."""
        own = set()
        room = self.mutants[number]['room'].split('/')[-1].replace('-', '_')
        listing = os.path.join(self.copy, 'tests', 'hal' if room == 'config' else room, 'CMakeLists.txt')
        if os.path.exists(listing):
            with open(listing, encoding='utf-8') as file:
                own = set(re.findall(r'tandem_test\((\w+)', file.read()))
        found = []
        for program, known in self.state['reach'].items():
            if program == 'kernels' or program in self.left_out:
                continue
            coming = [(c['s'], name) for name, c in known['cases'].items()
                      if c['passed'] and number in c['by']]
            weight = 0.2 if program in own else 1.0
            part, cost = [], 0.0
            for seconds, name in sorted(coming) + [(math.inf, '')]:
                if part and cost + seconds > 5.0:
                    found.append((weight * cost, program, part, cost))
                    part, cost = [], 0.0
                part, cost = part + [name], cost + seconds
        return [one[1:] for one in sorted(found)]

    def kill_by_kernels(self, number):
        """Whether tests of kernels made by the mutated generator fail."""
        if number not in self.state['reach']['kernels']['cases']['made']['by']:
            return None
        self.restore()
        status, _, _ = self.make_kernels(number)
        if status != 0:
            return 'the kernels of double_pendulum are not made'
        cases = [name for name, c in self.state['reach']['model_test']['cases'].items()
                 if c['passed'] and c['s'] < 5.0]
        status, text = self.gtest(number, 'model_test', cases, 300)
        self.restore()
        failed = re.findall(r'^\[  FAILED  \] (\S+?),? ', text, re.M)
        return f'model_test {failed[0] if failed else "crashed"} with its kernels' if status else None

    def try_one(self, number):
        spent, left_out, bounded, began = 0.0, [], False, time.monotonic()
        chunks = self.chunks(number)
        result = {'verdict': 'survived' if chunks else 'not-reached', 'cases': sum(len(c[1]) for c in chunks)}
        for program, cases, cost in chunks:
            if spent + cost > self.options.limit and spent > 0:
                bounded = True
                continue
            spent += cost
            while cases:
                self.restore()
                status, text = self.gtest(number, program, cases, 30 + 5 * cost)
                if status == 0:
                    break
                failed = re.findall(r'^\[  FAILED  \] (\S+?)(?:,| \()', text, re.M)
                running = re.findall(r'^\[ RUN      \] (\S+)', text, re.M)  # the last one crashed
                case = failed[0] if failed else running[-1] if running else ''
                if status is None and case:  # Slow only because the machine is?
                    self.restore()
                    status, _ = self.gtest(number, program, [case], 60 + 10 * cost)
                    if status == 0:
                        cases = [name for name in cases if name != case]
                        continue
                self.restore()
                again, _ = self.gtest(0, program, [case] if case else cases[:1], 60 + 5 * cost)
                if again == 0:
                    result.update(verdict='timed-out' if status is None else 'caught',
                                  by=f'{program} {case}', status=status)
                    break
                left_out.append(case)  # It fails by itself now and then.
                cases = [name for name in cases if name != case] if case else []
            if result['verdict'] in ('caught', 'timed-out'):
                break
        if result['verdict'] in ('survived', 'not-reached') and self.mutants[number]['room'] == 'model':
            by = self.kill_by_kernels(number)
            if by:
                result.update(verdict='caught', by=by)
            elif number in self.state['reach']['kernels']['cases']['made']['by']:
                result['verdict'] = 'survived'
        if bounded and result['verdict'] == 'survived':
            result['bounded'] = True
        if left_out:
            result['left_out'] = left_out
        result['s'] = round(time.monotonic() - began, 1)
        return result

    def check(self):
        selected = self.selected()
        wanted = [n for n in selected if str(n) not in self.state['results']]
        for at, number in enumerate(wanted, 1):
            one = self.mutants[number]
            result = self.try_one(number)
            self.state['results'][str(number)] = dict(
                result, **{key: one[key] for key in ('room', 'file', 'line', 'kind', 'original', 'mutated')})
            self.save()
            print(f'[{at}/{len(wanted)}] {number} {one["file"]}:{one["line"]} {one["kind"]}: '
                  f'{result["verdict"]} ({result.get("by", "")}) {result["s"]} s', flush=True)
            if result['verdict'] in ('survived', 'not-reached'):
                print(f'    - {one["original"]}\n    + {one["mutated"]}', flush=True)

    def report(self):
        results = self.state['results']
        verdicts = ['caught', 'timed-out', 'survived', 'not-reached']
        table = collections.defaultdict(collections.Counter)
        for one in results.values():
            table[one['room']][one['verdict']] += 1
            table['all'][one['verdict']] += 1
        print(f'\n{"room":18}{"mutations":>10}' + ''.join(f'{v:>13}' for v in verdicts))
        for room in [r for r in ROOMS if r in table] + ['all'] * bool(table):
            print(f'{room:18}{sum(table[room].values()):>10}'
                  + ''.join(f'{table[room][v]:>13}' for v in verdicts))
        total = sum(table['all'].values())
        good = table['all']['caught'] + table['all']['timed-out']
        if total:
            print(f'{good} of {total} caught: {100 * good / total:.1f} %')
        for verdict in ('survived', 'not-reached'):
            for number, one in sorted(results.items(), key=lambda item: int(item[0])):
                if one['verdict'] == verdict:
                    print(f'\n{verdict} {number} {one["file"]}:{one["line"]} ({one["kind"]}'
                          + (', bounded' if one.get('bounded') else '') + ')\n'
                          f'  - {one["original"]}\n  + {one["mutated"]}')

    def again(self, numbers):
        """Forgets what survived, and takes the tests as they are now."""
        for number, one in list(self.state['results'].items()):
            if number in numbers or (not numbers and one['verdict'] in ('survived', 'not-reached')):
                del self.state['results'][number]
        self.copy_tree('tests')
