!! What razy-modes finds for a machine of any scene but `rotor`: natural frequencies and shapes with contacts in a chosen state.
module razy_study_modes_machine
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_neutral
   use razy_eigen_damped, only: damped_eigen, modal_scaling
   use razy_eigen_decay, only: forms_t, judge
   use razy_eigen_free_modes, only: modes_beside
   use razy_eigen_mode_branches, only: energy_shares, hertz
   use razy_input_input, only: input_t
   use razy_linalg_dense, only: congruence_of, rising_order
   use razy_linalg_generalised, only: orient
   use razy_linalg_pattern, only: connected_sets
   use razy_machine_free_motions, only: linear_free_motions
   use razy_machine_linearised, only: linear_ok, linearise, state_asked_for
   use razy_machine_machine, only: machine_t
   use razy_study_modes_result, only: modes_result_t
   implicit none(type, external)
   private

   public :: find_machine_modes

contains

   !> The `count` lowest modes with the contacts in the state `contacts` of `linearised`.
   subroutine find_machine_modes(content, machine, input, count, contacts, error)
      type(modes_result_t), intent(inout) :: content
      type(machine_t), intent(in) :: machine
      type(input_t), intent(in) :: input
      integer, intent(in) :: count, contacts
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: basis(:, :), damping(:, :), of_stiffness(:, :), slope(:, :), squared(:), &
                               stiffness(:, :), untouched(:, :)
      integer, allocatable :: order(:), verdict(:)
      complex(wp), allocatable :: values(:)
      integer :: culprit, kept, status

      call linearise(machine, contacts, stiffness, damping, status, culprit, slope)
      if (status /= linear_ok) call input%complain(error, "modes", 1, "contacts", state_asked_for(machine, status, culprit))
      if (allocated(error)) return
      call linear_free_motions(machine, slope, of_stiffness, untouched)
      call modes_beside(stiffness, machine%mass, of_stiffness, untouched, squared, basis, status)
      if (status == 0) then
         call find_damped(values, verdict, squared, congruence_of(damping, basis), &
                          size(of_stiffness, 2) - size(untouched, 2), status)
      end if
      if (status == 0) call modes_beside(stiffness, machine%mass, of_stiffness, untouched(:, :0), squared, basis, status)
      if (status /= 0) call raise(error, "the eigenproblem could not be solved")
      if (allocated(error)) return
      kept = min(count, size(squared))
      order = rising_order(squared)
      basis = basis(:, order(:kept))
      call orient(basis)
      content%rigid = merge(1, 0, order(:kept) <= size(of_stiffness, 2))
      content%free = ""
      content%share = energy_shares(basis, machine%mass)
      content%coordinate = machine%coordinate
      content%part = content%coordinate
      content%natural = hertz(squared(order(:kept)))
      content%shape = basis
      content%speed = [0.0_wp]
      content%frequency = reshape(content%natural, [kept, 1])
      values = [spread((0.0_wp, 0.0_wp), 1, size(untouched, 2)), values]
      content%eigenvalue = reshape(values, [size(values), 1])
      content%verdict = reshape([spread(is_neutral, 1, size(untouched, 2)), verdict], shape(content%eigenvalue))
   end subroutine find_machine_modes

   !> Damped eigenvalues with Im >= 0, and what they say of stability, in modes with `squared` omega² (p) and `damping` (p, p);
   !> `resting` of them are motions that dampers alone resist.
   subroutine find_damped(value, verdict, squared, damping, resting, status)
      complex(wp), allocatable, intent(out) :: value(:)
      integer, allocatable, intent(out) :: verdict(:)
      real(wp), intent(in) :: squared(:), damping(:, :)
      integer, intent(in) :: resting
      integer, intent(out) :: status

      type(forms_t), allocatable :: forms(:)
      complex(wp), allocatable :: shape(:, :)
      real(wp), allocatable :: largest(:), scaling(:)
      integer, allocatable :: part(:)
      integer :: i

      call damped_eigen(squared, damping, value, status, shape=shape)
      if (status /= 0) return
      scaling = modal_scaling(squared)
      part = connected_sets(abs(damping) > 0.0_wp)
      allocate (forms(size(value)), largest(size(value)))
      do i = 1, size(value)
         largest(i) = maxval(scaling, part == part(maxloc(abs(shape(:, i)), dim=1)))
         associate (u => shape(:, i)/scaling)
            associate (moved => abs(u))
               forms(i) = forms_t(sum(moved**2), sum(squared*moved**2), real(dot_product(u, matmul(damping, u)), wp), 0.0_wp, &
                                  dot_product(moved, matmul(abs(damping), moved)), 0.0_wp)
            end associate
         end associate
      end do
      call judge(value, largest, forms, resting, verdict)
   end subroutine find_damped

end module razy_study_modes_machine
