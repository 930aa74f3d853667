"""All studies by kind: where each stands, and what its command takes.

``python -m gearchaos.studies.core.generate`` writes this from the classes of the studies. It is all that public names
and commands need of them: nothing slow is loaded for them.
"""

from typing import Any

STUDIES: dict[str, dict[str, Any]] = {
    'simulate': {
        'module': 'studies.motion.simulate', 'class': 'Simulate',
        'help': 'Integrate one motion: its stroboscopic section, one state per mesh period, and samples in time.',
        'group': 'Motions', 'needs_out': False, 'summary': 'section',
        'axes': {},
        'options': {
            'periods': {'type': 'int', 'help': 'Mesh periods to record.', 'least': 1, 'required': True},
            'transient': {
                'type': 'int', 'help': 'Mesh periods before the recorded ones; 0 by default.', 'least': 0,
            },
            'samples': {
                'type': 'int', 'help': 'Instants recorded in each mesh period, at equal distances.', 'least': 1,
                'file_only': 'Stdout shows only the stroboscopic section.',
            },
        },
        'run_options': {},
    },
    'regime': {
        'module': 'studies.motion.regime', 'class': 'Regime',
        'help': 'Classify the motion at one operating point, with its evidence.', 'group': 'Motions',
        'needs_out': False, 'summary': 'result',
        'axes': {},
        'options': {},
        'run_options': {},
    },
    'attractors': {
        'module': 'studies.motion.attractors', 'class': 'Attractors',
        'help': 'Find all attractors of one operating point, with the share of the initial states that lead to each.',
        'group': 'Motions', 'needs_out': False, 'summary': 'attractors',
        'axes': {},
        'options': {
            'starts': {
                'type': 'int',
                'help': 'Number of initial states, points of a scrambled Sobol sequence in the box; 256 by default.',
                'least': 1,
            },
            'seed': {
                'type': 'int', 'help': 'Seed of the Sobol sequence of initial states; 0 by default.', 'least': 0,
            },
            'sweep': {
                'type': 'axis',
                'help': 'A parameter that is also swept slowly to its value in the model, from both ends.',
            },
            'kicks': {
                'type': 'int',
                'help': 'Directions in which to search the smallest perturbation that leaves a basin; 0 by default.',
                'least': 0,
            },
        },
        'run_options': {},
    },
    'bifurcation': {
        'module': 'studies.maps.bifurcation', 'class': 'Bifurcation',
        'help': 'Scan one parameter: stroboscopic points, verdicts and exponents.', 'group': 'Bifurcations',
        'needs_out': True, 'summary': 'map',
        'axes': {'axis': None},
        'options': {
            'points': {
                'type': 'int', 'help': 'Stroboscopic points per column, 0 for the verdicts alone; 128 by default.',
                'least': 0,
            },
            'mode': {
                'type': 'str',
                'help': "Columns from the model's initial values, or a sweep up or down; fixed by default.",
                'metavar': 'fixed|up|down', 'choices': ('fixed', 'up', 'down'),
            },
        },
        'run_options': {},
    },
    'rattle': {
        'module': 'studies.vibration.rattle', 'class': 'Rattle',
        'help': 'Scan a train for rattle: where its meshes lose contact, their impacts, and the drag that stops them.',
        'group': 'Motions', 'needs_out': False, 'summary': 'rattle',
        'axes': {'axis': None},
        'options': {'mesh': {'type': 'str', 'help': 'The mesh whose onset is looked for; by default all.'}},
        'run_options': {},
    },
    'fit': {
        'module': 'studies.fit.fit', 'class': 'Fit',
        'help': 'Fit damping, backlash and transmission error of a gear pair to measured orders over the speed.',
        'group': 'Gears', 'needs_out': False, 'summary': 'fit',
        'axes': {},
        'options': {
            'measured': {
                'type': 'str',
                'help': 'A table of speed, order of wheel 1 and amplitude, rms or peak to peak, or such spectra, .uff.',
                'required': True,
            },
            'vary': {
                'type': 'tuple[str, ...]',
                'help': 'Parameters and their bounds: damping_ratio=0.02:0.15, backlash=0.05:0.25 mm, error1=1:20 um.',
                'required': True,
            },
            'quantity': {
                'type': 'str', 'help': 'What was measured; mesh force by default.',
                'metavar': 'mesh force|deflection|transmission error|acceleration',
                'choices': ('mesh force', 'deflection', 'transmission error', 'acceleration'),
            },
            'uncertainty': {
                'type': 'str',
                'help': 'Standard deviation of an amplitude: "5 %", or "2 N"; by default equal for all, and estimated.',
            },
            'starts': {
                'type': 'int', 'help': 'Searches from a Sobol sequence within the bounds; 8 by default.', 'least': 1,
            },
            'seed': {'type': 'int', 'help': 'Of that sequence; 0 by default.', 'least': 0},
        },
        'run_options': {},
    },
    'orders': {
        'module': 'studies.vibration.orders', 'class': 'Orders',
        'help': 'Compute the order spectrum of a steady motion, its lines named by mesh harmonics and sidebands.',
        'group': 'Gears', 'needs_out': False, 'summary': 'orders',
        'axes': {},
        'options': {
            'mesh': {
                'type': 'str', 'help': 'Of a train, the mesh that is looked at; by default the first.',
            },
            'samples': {
                'type': 'int',
                'help': 'Instants of each mesh period at which it is taken for its spectrum; 64 by default.',
                'least': 16,
            },
            'quantity': {
                'type': 'str', 'help': 'What the spectrum is of; mesh force by default.',
                'metavar': 'mesh force|deflection|transmission error|acceleration',
                'choices': ('mesh force', 'deflection', 'transmission error', 'acceleration'),
            },
            'rms': {'type': 'bool', 'help': 'Root mean squares of the lines instead of their peaks.'},
        },
        'run_options': {},
    },
    'runup': {
        'module': 'studies.runup.runup', 'class': 'RunUp',
        'help': 'Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force.',
        'group': 'Gears', 'needs_out': False, 'summary': 'runup',
        'axes': {'speed': 2},
        'options': {
            'duration': {'type': 'float', 'help': 'Of the run-up, in s; 60 by default.'},
            'mesh': {
                'type': 'str', 'help': 'Of a train, the mesh that is looked at; by default the first.',
            },
            'samples': {
                'type': 'int',
                'help': 'Instants of each mesh period at which it is taken for its spectrum; 64 by default.',
                'least': 16,
            },
            'down': {'type': 'bool', 'help': 'Run down again as well, in the same time.'},
            'torque': {
                'type': 'table', 'help': 'A table of the torque over time or speed, linear between rows.',
            },
            'events': {
                'type': 'bool', 'help': 'Find the event that ends the branch of the motion before each jump.',
            },
        },
        'run_options': {'journal': {'type': 'part', 'help': 'A file that keeps what is computed.'}},
    },
    'scatter': {
        'module': 'studies.uncertainty.scatter', 'class': 'Scatter',
        'help': 'Say what the scatter of uncertain inputs does to contact loss and dynamic factor along the speed.',
        'group': 'Gears', 'needs_out': False, 'summary': 'scatter',
        'axes': {'speed': None},
        'options': {
            'vary': {
                'type': 'tuple[str, ...]',
                'help': 'Inputs with distributions: backlash=0.10:0.25 mm, damping_ratio=0.05±0.01, quality.grade=6:8.',
                'required': True,
            },
            'torque': {
                'type': 'tuple[float, ...]',
                'help': 'Torques at wheel 1, numbers in N m or texts; by default that of the gears.',
            },
            'samples': {
                'type': 'int',
                'help': 'Designs from which probabilities follow, 16 times a power of two; 1024 by default.',
                'least': 32,
            },
            'factor': {
                'type': 'float', 'help': 'Limit of the dynamic factor over the quasi-static ratio; 1.5 by default.',
            },
            'indices': {
                'type': 'bool',
                'help': 'Also compute the indices of Sobol, from half as many designs again for each input.',
            },
            'start': {
                'type': 'str', 'help': 'Initial states of the motions; rest by default.',
                'metavar': 'rest|static deflection|steady contact',
                'choices': ('rest', 'static deflection', 'steady contact'),
            },
            'correlations': {
                'type': 'tuple[tuple[str, str, float], ...]',
                'help': 'Of pairs of inputs, as [first, second, correlation]: a Gaussian copula.',
            },
            'load_change': {
                'type': 'float',
                'help': 'The load is -LAMBDA times itself for a time: 1 reversal, 0 loss, -0.5 half; 1 by default.',
            },
            'wide': {
                'type': 'bool', 'help': 'Look at wide ranges of states instead, which no load stores.',
            },
            'seed': {'type': 'int', 'help': 'Of the samples; 0 by default.', 'least': 0},
            'budget': {
                'type': 'int', 'help': 'Most motions that are followed; 2000000 by default.', 'least': 1,
            },
        },
        'run_options': {},
    },
    'zones': {
        'module': 'studies.maps.zones', 'class': 'Zones', 'help': 'Map the kinds of motion over two parameters.',
        'group': 'Motions', 'needs_out': True, 'summary': 'map',
        'axes': {'x': None, 'y': None},
        'options': {
            'starts': {
                'type': 'int', 'help': 'Number of initial states in each cell, to find all its motions; 1 by default.',
                'least': 1,
            },
            'load_change': {
                'type': 'float',
                'help': 'The load is -LAMBDA times itself for a time: 1 reversal, 0 loss, -0.5 half; 1 by default.',
                'metavar': 'LAMBDA',
            },
            'wide': {
                'type': 'bool', 'help': 'Of given gears too, look at wide ranges of states, which no load stores.',
            },
            'refine': {
                'type': 'int',
                'help': 'Every N-th row and column; more cells only where neighbours differ; 1 by default.',
                'metavar': 'N', 'least': 1,
            },
            'prove': {'type': 'bool', 'help': 'Prove the periodic motions in ball arithmetic.'},
            'certificates': {
                'type': 'str', 'help': 'Write a certificate for each proved cell to this folder.', 'metavar': 'DIR',
            },
        },
        'run_options': {},
    },
    'basins': {
        'module': 'studies.motion.basins', 'class': 'Basins',
        'help': 'Map the basins of attraction over two initial values.', 'group': 'Motions', 'needs_out': True,
        'summary': 'map',
        'axes': {'x': None, 'y': None},
        'options': {},
        'run_options': {},
    },
    'branch': {
        'module': 'studies.orbits.branch', 'class': 'Branch',
        'help': 'Follow a branch of periodic orbits along one parameter, stable or not, with all its events.',
        'group': 'Bifurcations', 'needs_out': False, 'summary': 'branch',
        'axes': {'axis': 2},
        'options': {
            'start': {
                'type': 'values', 'help': 'Initial values near the first orbit; by default those of the model.',
            },
            'period': {
                'type': 'int', 'help': 'Minimal period; by default that of the motion that the start leads to.',
            },
            'longest_step': {'type': 'float', 'help': 'Longest step; 0.03 by default.'},
            'max_points': {
                'type': 'int', 'help': 'Largest number of points in each direction; 10000 by default.', 'least': 2,
            },
            'cascade': {
                'type': 'int', 'help': 'Period doublings to follow from the first flip; 0 by default.', 'least': 0,
            },
            'pitchforks': {'type': 'bool', 'help': 'Follow both branches at each pitchfork.'},
        },
        'run_options': {},
    },
    'curve': {
        'module': 'studies.orbits.curve', 'class': 'Curve',
        'help': 'Follow the curve of an event of periodic orbits over two parameters.', 'group': 'Bifurcations',
        'needs_out': False, 'summary': 'curve',
        'axes': {'x': 2, 'y': 2},
        'options': {
            'event': {
                'type': 'str', 'help': 'The event whose curve is followed.',
                'metavar': 'fold|flip|neimark-sacker|graze', 'choices': ('fold', 'flip', 'neimark-sacker', 'graze'),
                'required': True,
            },
            'start': {
                'type': 'values', 'help': 'Initial values near the first orbit; by default those of the model.',
            },
            'period': {
                'type': 'int', 'help': 'Minimal period; by default that of the motion that the start leads to.',
            },
            'longest_step': {'type': 'float', 'help': 'Longest step; 0.02 by default.'},
            'max_points': {
                'type': 'int', 'help': 'Largest number of points in each direction; 10000 by default.', 'least': 2,
            },
        },
        'run_options': {},
    },
    'skeleton': {
        'module': 'studies.orbits.skeleton', 'class': 'Skeleton',
        'help': 'Find all curves of events in a window of two parameters.', 'group': 'Bifurcations', 'needs_out': True,
        'summary': 'skeleton',
        'axes': {'x': 48, 'y': 24},
        'options': {
            'period': {'type': 'int', 'help': 'Largest period of the orbits; 4 by default.', 'least': 1},
            'lines': {
                'type': 'tuple[int, int]',
                'help': 'Numbers of lines along x and along y on which events are searched; 8 and 5 by default.',
            },
            'starts': {
                'type': 'int', 'help': "Initial states at each place, besides the model's own; 3 by default.",
                'least': 0,
            },
        },
        'run_options': {
            'journal': {'type': 'part', 'help': 'A file that keeps finished work.'},
            'workers': {'type': 'int', 'help': 'Processes, by default one per core.'},
        },
    },
    'manifolds': {
        'module': 'studies.orbits.saddles', 'class': 'Manifolds',
        'help': 'Find the saddles of a model with two coordinates, and their stable and unstable manifolds.',
        'group': 'Bifurcations', 'needs_out': True, 'summary': 'result',
        'axes': {},
        'options': {
            'period': {
                'type': 'int', 'help': 'Largest period of the saddles, in mesh periods; 4 by default.', 'least': 1,
            },
            'length': {
                'type': 'float',
                'help': 'Arclength inside the region of each branch, in half backlashes; 30 by default.',
            },
            'spacing': {
                'type': 'float', 'help': 'Largest distance of neighbouring points inside the region; 0.03 by default.',
            },
        },
        'run_options': {},
    },
    'edge_state': {
        'module': 'studies.orbits.saddles', 'class': 'EdgeTracking',
        'help': 'Find the saddle that divides the basins of two attractors, for any number of coordinates.',
        'group': 'Bifurcations', 'needs_out': True, 'summary': 'edge',
        'axes': {},
        'options': {
            'first': {
                'type': 'values', 'help': 'Initial values that lead to one attractor.', 'required': True,
            },
            'second': {
                'type': 'values', 'help': 'Initial values that lead to another one.', 'required': True,
            },
            'period': {'type': 'int', 'help': 'Largest period of the saddle, in mesh periods; 4 by default.'},
            'rounds': {
                'type': 'int', 'help': 'Most times two neighbouring states are brought together again; 60 by default.',
                'least': 1,
            },
        },
        'run_options': {},
    },
}
