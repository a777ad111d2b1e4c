from setuptools import find_packages, setup

package = 'maglev_monitor'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='Maglev stage maintainers',
    maintainer_email='maintainers@maglev-stage.org',
    description='Metrics, recording, bag analysis and report of the maglev stage, and their nodes',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'monitor = maglev_monitor.live.node:main',
            'recorder = maglev_monitor.bag.recorder:main',
            'compare_bags = maglev_monitor.bag.compare_cli:main',
            'analyze = maglev_monitor.report.analyze_cli:main',
        ]
    },
)
