"""Build auv_analysis, for colcon and for pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = 'auv_analysis'

setup(
    name=NAME,
    version='0.1.0',
    description='Experiments, recording, energy and coupling analysis, reports, the auv command',
    license='Apache-2.0',
    license_files=['LICENSE'],
    classifiers=[
        'Intended Audience :: Science/Research',
        'License :: OSI Approved :: Apache Software License',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3.11',
        'Programming Language :: Python :: 3.12',
        'Programming Language :: Python :: 3.13',
        'Topic :: Scientific/Engineering',
        'Typing :: Typed',
    ],
    keywords=['ROS', 'underwater vehicles'],
    maintainer='auv_gvc developers',
    maintainer_email='auv-gvc@users.noreply.github.com',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        NAME: [
            'py.typed',
            '*/*.json',
            '*/*/*.json',
            'herman2018/*.j2',
            'report/*.j2',
            'report/*.css',
            'report/*.js',
            'studies/sweep/*.json',
            'bag/*.json',
        ]
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/launch', glob('launch/*.launch.py')),
        (f'share/{NAME}/config/scenarios', glob('config/scenarios/*.yaml')),
        (f'share/{NAME}/config/params', glob('config/params/*.yaml')),
        (f'share/{NAME}/config/campaigns', glob('config/campaigns/*.yaml')),
        (f'share/{NAME}/config/laws', glob('config/laws/own_law.*')),
        (f'share/{NAME}/config/layouts', glob('config/layouts/*')),
        (f'share/{NAME}/config/security', glob('config/security/*.xml')),
        (f'share/{NAME}/config/security/common', glob('config/security/common/*.xml')),
        (f'share/{NAME}/config/security/profiles', glob('config/security/profiles/*.xml')),
    ],
    python_requires='>=3.11',
    install_requires=[
        'setuptools',
        'auv_dynamics',
        'auv_gvc_controller',
        'numpy>=1.26',
        'PyYAML>=6',
        'jsonschema>=4.10',
        'mcap>=1.5',
        'mcap-ros2-support>=0.5.5',
        'zstandard>=0.19',
        'lz4>=4.0',
        'matplotlib>=3.6',
        'Pillow>=9',
        'Jinja2>=3.0',
        'bokeh>=3.4,<4',
        'defusedxml>=0.7.1',
        'psutil>=5.9.4',
        'setproctitle>=1.3',
        'rich>=13',
        'pyarrow>=17',
        'scipy>=1.15',
        'rosbags>=0.10',
        'SALib>=1.5',
        'argcomplete>=3.1',
        'packaging>=23',
    ],
    extras_require={
        'test': ['pytest', 'pillow'],
        'dask': ['distributed>=2024.8'],
        'rerun': ['rerun-sdk>=0.41,<1'],
        'mavlink': ['pymavlink>=2.4.40,<3'],
        'mesh': [
            'capytaine>=3,<4',
            'trimesh>=5,<6',
            'manifold3d>=3,<4',
            'fast-simplification>=0.1.12,<1',
            'networkx>=3,<4',
        ],
    },
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'auv = auv_analysis.cli.main:main',
            'recorder_node = auv_analysis.nodes.recorder_node:main',
            'analysis_node = auv_analysis.nodes.analysis_node:main',
            'replay_node = auv_analysis.nodes.replay_node:main',
            'composed_graph = auv_analysis.nodes.composed_graph:main',
        ]
    },
)
