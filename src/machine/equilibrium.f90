!! Static equilibrium under the constant loads, contacts included.
!!
!! The potential energy ½ qᵀKq + Σ U_j(s_j) - f0ᵀq of a machine with clearance laws is convex and piecewise quadratic. It is
!! minimised by Newton's method in the contact state at hand with an exact line search over the points where contacts
!! open or close; that ends after finitely many steps. Rigid-body displacements are left out: of all equilibria the one that
!! is orthogonal (in M) to the modes of zero stiffness is taken. Excitation does not count.
module razy_machine_equilibrium
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: find_equilibrium

   integer, parameter :: most_iterations = 200
   !> Stiffness below this part of the largest, and residuals below this part of the loads, are rounding.
   real(wp), parameter :: negligible = 1.0e-11_wp

contains

   !> Equilibrium displacement `q` (n). `found` is false if the loads do work on a free rigid-body motion.
   subroutine find_equilibrium(machine, q, found)
      type(machine_t), intent(in) :: machine
      real(wp), intent(out) :: q(:)
      logical, intent(out) :: found

      real(wp) :: inverse_root(size(q), size(q)), residual(size(q)), direction(size(q)), step
      integer :: i

      call inverse_square_root(machine%mass, inverse_root)
      q = 0.0_wp
      found = .false.
      do i = 1, most_iterations
         residual = restoring(machine, q) - machine%load
         call newton_direction(machine, inverse_root, q, residual, direction)
         if (norm2(direction) <= 0.0_wp) then
            found = .true.
            return
         end if
         call line_search(machine, q, direction, step)
         if (step > 0.1_wp*huge(1.0_wp)) return
         q = q + step*direction
         if (abs(step - 1.0_wp) <= 1.0e-9_wp .and. settled(machine, q, inverse_root)) then
            found = .true.
            return
         end if
      end do
   end subroutine find_equilibrium

   !> Whether what is left of the residual is rounding.
   pure function settled(machine, q, inverse_root)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: q(:), inverse_root(:, :)
      logical :: settled

      real(wp) :: rest(size(q))

      rest = matmul(inverse_root, restoring(machine, q) - machine%load)
      settled = norm2(rest) <= negligible*(norm2(matmul(inverse_root, machine%load)) &
                                           + norm2(matmul(abs(inverse_root), restoring(machine, q, .true.))))
   end function settled

   !> K q + Σ w F(s), N (N m); with `moduli` the sum of the moduli of all terms.
   pure function restoring(machine, q, moduli) result(force)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: q(:)
      logical, intent(in), optional :: moduli
      real(wp) :: force(size(q))

      real(wp) :: s
      integer :: j

      force = matmul(machine%stiffness, q)
      if (present(moduli)) force = matmul(abs(machine%stiffness), abs(q))
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            s = dot_product(contact%w, q) + contact%offset
            associate (branch => contact%law%branch(contact%law%initial_branch(s, 0.0_wp)))
               if (present(moduli)) then
                  force = force + abs(contact%w)*(branch%stiffness*abs(s) + abs(branch%offset))
               else
                  force = force + contact%w*(branch%stiffness*s + branch%offset)
               end if
            end associate
         end associate
      end do
   end function restoring

   !> Newton's direction in the present contact state; along modes without stiffness down the residual, if there is any.
   subroutine newton_direction(machine, inverse_root, q, residual, direction)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: inverse_root(:, :), q(:), residual(:)
      real(wp), intent(out) :: direction(:)

      real(wp) :: k(size(q), size(q)), values(size(q)), part(size(q)), drive(size(q)), s
      integer :: i, info, j

      k = machine%stiffness
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            s = dot_product(contact%w, q) + contact%offset
            associate (branch => contact%law%branch(contact%law%initial_branch(s, 0.0_wp)))
               do i = 1, size(q)
                  k(:, i) = k(:, i) + branch%stiffness*contact%w*contact%w(i)
               end do
            end associate
         end associate
      end do
      k = matmul(inverse_root, matmul(k, inverse_root))
      call symmetric_eigen(k, values, info)
      direction = 0.0_wp
      if (info /= 0) return
      drive = matmul(inverse_root, residual)
      part = matmul(transpose(k), drive)
      associate (free => abs(values) <= negligible*maxval(abs(values)))
         where (abs(part) <= negligible*(norm2(matmul(inverse_root, machine%load)) + tiny(1.0_wp))) part = 0.0_wp
         if (any(free .and. abs(part) > 0.0_wp)) then
            where (free)
               part = -part
            else where
               part = 0.0_wp
            end where
         else
            where (.not. free)
               part = -part/values
            else where
               part = 0.0_wp
            end where
         end if
      end associate
      direction = matmul(inverse_root, matmul(k, part))
   end subroutine newton_direction

   !> The step along `direction` at which the energy is least; huge if it falls without end.
   subroutine line_search(machine, q, direction, step)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: q(:), direction(:)
      real(wp), intent(out) :: step

      real(wp) :: edges(2*size(machine%contact)), s, rate, low, high, slope_low, slope_high
      integer :: j, n

      n = 0
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            s = dot_product(contact%w, q) + contact%offset
            rate = dot_product(contact%w, direction)
            associate (open => contact%law%guard(1, 1))
               if (open%above /= 0) call add(open%upper)
               if (open%below /= 0) call add(open%lower)
            end associate
         end associate
      end do
      low = 0.0_wp
      slope_low = slope(low)
      do
         high = huge(1.0_wp)
         if (any(edges(:n) > low)) high = minval(edges(:n), edges(:n) > low)
         if (high > 0.5_wp*huge(1.0_wp)) exit
         slope_high = slope(high)
         if (slope_high >= 0.0_wp) then
            step = low
            if (slope_low < 0.0_wp) step = low - slope_low*(high - low)/(slope_high - slope_low)
            return
         end if
         low = high
         slope_low = slope_high
      end do
      ! Beyond the last edge the slope is linear, so one more point tells where it vanishes.
      high = low + max(1.0_wp, low)
      slope_high = slope(high)
      step = huge(1.0_wp)
      if (slope_high > slope_low + negligible*abs(slope_low)) step = low - slope_low*(high - low)/(slope_high - slope_low)

   contains

      subroutine add(edge)
         real(wp), intent(in) :: edge

         if (.not. abs(rate) > 0.0_wp) return
         n = n + 1
         edges(n) = (edge - s)/rate
      end subroutine add

      pure function slope(t)
         real(wp), intent(in) :: t
         real(wp) :: slope

         slope = dot_product(direction, restoring(machine, q + t*direction) - machine%load)
      end function slope

   end subroutine line_search

   !> Symmetric root of the inverse of a positive definite matrix.
   subroutine inverse_square_root(matrix, root)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(out) :: root(:, :)

      real(wp) :: vectors(size(matrix, 1), size(matrix, 1)), values(size(matrix, 1))
      integer :: i, info

      vectors = matrix
      call symmetric_eigen(vectors, values, info)
      do i = 1, size(values)
         root(:, i) = vectors(:, i)/sqrt(max(values(i), tiny(1.0_wp)))
      end do
      root = matmul(root, transpose(vectors))
   end subroutine inverse_square_root

end module razy_machine_equilibrium
