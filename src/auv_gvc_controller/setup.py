"""Build auv_gvc_controller, for colcon and for pip."""

from setuptools import find_packages, setup

NAME = 'auv_gvc_controller'

setup(
    name=NAME,
    version='0.1.0',
    description='Velocity control in generalised velocity components: laws, set-points, nodes',
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
    package_data={NAME: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
    ],
    python_requires='>=3.11',
    install_requires=['setuptools', 'auv_dynamics', 'numpy>=1.26'],
    extras_require={'test': ['pytest']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'setpoint_node = auv_gvc_controller.nodes.setpoint_node:main',
            'controller_node = auv_gvc_controller.nodes.controller_node:main',
        ]
    },
)
