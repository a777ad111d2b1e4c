from setuptools import find_packages, setup

package = 'maglev_study'

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
    description='Studies of the maglev stage: closed loop as a library, comparison, tables',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'compare = maglev_study.comparison.main:main',
            'paper_tables = maglev_study.paper_tables:main',
            'terms = maglev_study.terms_cli:main',
        ]
    },
)
