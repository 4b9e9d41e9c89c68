"""Build auv_dynamics, for colcon and for pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = 'auv_dynamics'

setup(
    name=NAME,
    version='0.1.0',
    description='Underwater vehicle model, kinematics, integrator, disturbances and plant node',
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
        NAME: ['py.typed', '*/*.json', '*/*/*.json', 'ros/*.xml', 'vehicle/curves/*.csv']
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/config/vehicles', glob('config/vehicles/*.yaml')),
    ],
    python_requires='>=3.11',
    install_requires=['setuptools', 'numpy>=1.26', 'PyYAML>=6', 'jsonschema>=4.10'],
    extras_require={'fast': ['numba'], 'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'frame_converter_node = auv_dynamics.nodes.frame_converter_node:main',
            'plant_node = auv_dynamics.nodes.plant_node:main',
        ]
    },
)
